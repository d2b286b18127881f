#include "forms.h"

#define AT(place, name) {#name, place, name, 0, 0, 0}

const form FORMS[] = {
    AT(COMMAND, spool_friction), AT(COMMAND, stick_band),
    AT(PRESSURE, tube_wave), AT(PRESSURE, tube_cells), AT(PRESSURE, line_ladder), AT(PRESSURE, second_order),
    AT(PRESSURE, exhaust_orifice), AT(PRESSURE, exhaust_laminar), AT(PRESSURE, flow_servo),
    AT(PRESSURE, flow_choked), AT(PRESSURE, supply_soft), AT(PRESSURE, supply_tank),
    AT(PRESSURE, leak_turbulent), AT(PRESSURE, leak_laminar),
    AT(DRIVE, preisach_share), AT(DRIVE, duhem_friction), AT(CURVATURE, log_creep),
    AT(CURVATURE, eyring_creep),
    AT(DRIVE, roxburgh), AT(DRIVE, worked_soft), AT(DRIVE, warming_gain), AT(DRIVE, wandering_gain),
    {"recovery_viscosity", RATE, 0, recovery_viscosity, 0, 0}, AT(CURVATURE, sticky_release),
    AT(DRIVE, locking_chain), AT(DRIVE, balloon_curve), AT(DRIVE, slack_hinge), AT(DRIVE, preload),
    {"hertz_load", RATE, 0, 0, hertz_load, 0}, AT(CURVATURE, foam_pad),
    AT(DRIVE, duffing_share), AT(CURVATURE, side_mode),
    AT(READING, exponential_curve), AT(READING, divider_curve), AT(READING, uneven_hang),
    AT(READING, lens_curves),
    AT(READING, stretched_relaxation), AT(READING, healing_contacts), AT(OUTPUT, bessel_filter),
    AT(OUTPUT, two_depths), AT(OUTPUT, warming_offset), AT(OUTPUT, wandering_offset), AT(OUTPUT, soft_rail),
    AT(OUTPUT, sticky_rail), AT(SAMPLE, lazy_converter), AT(SAMPLE, uneven_converter),
    AT(PRESSURE, supply_ripple), AT(PRESSURE, opening_seam), AT(CURVATURE, room_swing),
    AT(DRIVE, loose_joint),
    AT(CURVATURE, knocking_play), AT(OUTPUT, pick_up), AT(OUTPUT, loose_plug), AT(READING, folded_reading),
    {"dry_block", GRIP, 0, 0, 0, dry_block}, {"stribeck_block", GRIP, 0, 0, 0, stribeck_block},
    {0, 0, 0, 0, 0, 0},
};
