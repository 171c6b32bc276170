/* The least host in C: a controller in static memory, three seconds at 1 kHz,
 * with a policy that never answers. */
#include <stdio.h>
#include <string.h>

#include "fitmac.h"

static _Alignas(16) unsigned char config_memory[FITMAC_CONFIG_STORAGE];
static _Alignas(16) unsigned char controller_memory[FITMAC_CONTROLLER_STORAGE];

static int failed(const char *what, fitmac_status status) {
    fprintf(stderr, "%s: %s\n", what, fitmac_status_text(status));
    return 1;
}

int main(void) {
    fitmac_config *config;
    fitmac_controller *controller;
    fitmac_status status =
        fitmac_config_init(config_memory, sizeof config_memory, "guarded", &config);
    if (status == FITMAC_STATUS_OK) {
        status = fitmac_config_set(config, "gate.failure_streak", "4");
    }
    if (status != FITMAC_STATUS_OK) {
        return failed("configuration", status);
    }
    status = fitmac_controller_init(controller_memory, sizeof controller_memory,
                                    FITMAC_ABI_VERSION, config, &controller);
    if (status != FITMAC_STATUS_OK) {
        return failed("controller", status);
    }

    fitmac_state_sample state;
    memset(&state, 0, sizeof state);
    state.session = 1;
    state.ee_position_m[0] = 0.45;
    state.ee_position_m[2] = 0.30;
    state.ee_orientation[1] = 1.0; /* the hand points down */
    state.gripper_width_m = 0.08;

    fitmac_input input = {.struct_size = sizeof input, .state = &state};
    fitmac_output output = {.struct_size = sizeof output};
    unsigned queries = 0;
    for (uint64_t tick = 1; tick <= 3000; tick++) {
        state.sequence = tick;
        state.stamp_ns = tick * 1000000u;
        state.applied_command = output.command.sequence;
        status = fitmac_tick(controller, tick * 1000000u, &input, &output);
        if (status != FITMAC_STATUS_OK) {
            return failed("tick", status); /* and stop the robot */
        }
        queries += output.has_query;
    }
    char mode[32];
    fitmac_name(FITMAC_VOCABULARY_MODE, output.command.mode, mode, sizeof mode);
    printf("%llu commands, mode %s, %u queries to the policy\n",
           (unsigned long long)output.command.sequence, mode, queries);
    return 0;
}
