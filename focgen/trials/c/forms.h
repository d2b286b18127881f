#include "chain.h"

#define ACTS(name) double name(effect *e, const chain *c, double in, double t)
ACTS(spool_friction); ACTS(stick_band); ACTS(tube_wave); ACTS(tube_cells); ACTS(line_ladder);
ACTS(second_order);
ACTS(exhaust_orifice); ACTS(exhaust_laminar); ACTS(flow_servo); ACTS(flow_choked); ACTS(supply_soft);
ACTS(supply_tank); ACTS(leak_turbulent); ACTS(leak_laminar);
ACTS(preisach_share); ACTS(duhem_friction); ACTS(log_creep); ACTS(eyring_creep); ACTS(roxburgh);
ACTS(worked_soft);
ACTS(warming_gain); ACTS(wandering_gain); ACTS(sticky_release); ACTS(locking_chain); ACTS(balloon_curve);
ACTS(slack_hinge); ACTS(preload); ACTS(foam_pad); ACTS(duffing_share); ACTS(side_mode);
ACTS(exponential_curve); ACTS(divider_curve); ACTS(uneven_hang); ACTS(lens_curves);
ACTS(stretched_relaxation);
ACTS(healing_contacts); ACTS(bessel_filter); ACTS(two_depths); ACTS(warming_offset); ACTS(wandering_offset);
ACTS(soft_rail); ACTS(sticky_rail); ACTS(lazy_converter); ACTS(uneven_converter);
ACTS(supply_ripple); ACTS(opening_seam); ACTS(room_swing); ACTS(loose_joint); ACTS(knocking_play);
ACTS(pick_up);
ACTS(loose_plug); ACTS(folded_reading);

double recovery_viscosity(const effect *e, double pull);
double dry_block(const effect *e, double speed);
double stribeck_block(const effect *e, double speed);
void hertz_load(const effect *e, double x, double *force, double *stiffness);
