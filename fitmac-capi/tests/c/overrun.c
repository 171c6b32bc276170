/* A host that lies about the size of a message: AddressSanitizer must catch the
 * library's read beyond it, or the other test proves nothing. */
#include <stdlib.h>
#include <string.h>

#include "fitmac.h"

int main(void) {
    fitmac_config *config = NULL;
    fitmac_controller *controller = NULL;
    void *memory = aligned_alloc(16, fitmac_config_size());
    if (fitmac_config_init(memory, fitmac_config_size(), NULL, &config) != FITMAC_STATUS_OK) {
        return 0;
    }
    memory = aligned_alloc(16, fitmac_controller_size());
    if (fitmac_controller_init(memory, fitmac_controller_size(), FITMAC_ABI_VERSION, config,
                               &controller) != FITMAC_STATUS_OK) {
        return 0;
    }
    fitmac_state_sample *state = calloc(1, 64); /* a sample is larger */
    state->sequence = 1;
    fitmac_input input = {.struct_size = sizeof input, .state = state};
    fitmac_output output = {.struct_size = sizeof output};
    fitmac_tick(controller, 1, &input, &output);
    return 0;
}
