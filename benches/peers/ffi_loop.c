/* A host in C: the control loop of the benchmark `ffi`. The library's tick is
 * handed over as a pointer, as a program gets it that loads the library. */
#include "fitmac.h"

typedef fitmac_status (*tick_function)(fitmac_controller *, uint64_t, const fitmac_input *,
                                       fitmac_output *);

/* Ticks through `count` inputs; the status of the first that failed, or OK. */
fitmac_status ffi_loop(tick_function tick, fitmac_controller *controller, const uint64_t *now_ns,
                       const fitmac_input *inputs, uint64_t count, fitmac_output *output) {
    for (uint64_t i = 0; i < count; i++) {
        const fitmac_status status = tick(controller, now_ns[i], &inputs[i], output);
        if (status != FITMAC_STATUS_OK) {
            return status;
        }
    }
    return FITMAC_STATUS_OK;
}
