/* A loop at 100 Hz around the library spba: curvature on A0, pressure on A1, the regulator on pin 9. */
#include <spba.h>

static spba_state controller;
static uint32_t due;
static float target = 0.01f; /* 1/mm; a number sent over the serial line replaces it */

void setup()
{
    Serial.begin(115200);
    pinMode(9, OUTPUT);
    spba_init(&controller);
    due = micros();
}

void loop()
{
    if ((uint32_t)(micros() - due) < SPBA_PERIOD_US) {
        return;
    }
    due += SPBA_PERIOD_US;
    if (Serial.available() > 0) {
        target = Serial.parseFloat();
    }
    const float curvature = 0.02f * analogRead(A0) / 1023.0f; /* 1/mm at 5 V: 0.02 */
    const float pressure = 0.25f * analogRead(A1) / 1023.0f;  /* bar at 5 V: 0.25 */
    const spba_sig u = spba_step(&controller, spba_ref_from_f32(target), spba_meas_from_f32(curvature),
                                 spba_sched_from_f32(pressure));

    analogWrite(9, (int)(255.0f * spba_u_to_f32(u) / 10.0f));
    if (spba_flags(&controller) & SPBA_FLAG_HIGH) {
        Serial.println("the regulator is at its upper end");
    }
}
