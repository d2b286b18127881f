// The same from C++: the header brings its own extern "C".
#include <cstdio>

#include "spba.h"

class Controller {
  public:
    Controller() { spba_init(&state_); }

    float step(float ref, float meas, float sched)
    {
        return spba_u_to_f32(spba_step(&state_, spba_ref_from_f32(ref), spba_meas_from_f32(meas),
                                       spba_sched_from_f32(sched)));
    }

  private:
    spba_state state_;
};

int main()
{
    static Controller controller;

    for (int k = 0; k < 5; k++) {
        std::printf("%.9g\n", static_cast<double>(controller.step(0.01f, 0.0f, 0.1f)));
    }
    return 0;
}
