/* What the border must withstand, each with the status that it must give.
 * Built with AddressSanitizer, the library too. Prints one line a fault row. */
#define _GNU_SOURCE
#include <fenv.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "fitmac.h"

#define REQUIRE(condition)                                                                     \
    do {                                                                                       \
        if (!(condition)) {                                                                    \
            fprintf(stderr, "%s:%d: %s does not hold\n", __FILE__, __LINE__, #condition);       \
            exit(1);                                                                           \
        }                                                                                      \
    } while (0)

#define GIVES(call, expected)                                                                  \
    do {                                                                                       \
        fitmac_status got_ = (call);                                                           \
        if (got_ != (expected)) {                                                              \
            fprintf(stderr, "%s:%d: %s gives %u (%s), not %s\n", __FILE__, __LINE__, #call,     \
                    (unsigned)got_, fitmac_status_text(got_), #expected);                      \
            exit(1);                                                                           \
        }                                                                                      \
    } while (0)

static fitmac_config *new_config(void) {
    void *memory = aligned_alloc(fitmac_config_alignment(), fitmac_config_size());
    fitmac_config *config = NULL;
    GIVES(fitmac_config_init(memory, fitmac_config_size(), NULL, &config), FITMAC_STATUS_OK);
    return config;
}

static fitmac_controller *new_controller(void) {
    fitmac_config *config = new_config();
    void *memory = aligned_alloc(fitmac_controller_alignment(), fitmac_controller_size());
    fitmac_controller *controller = NULL;
    GIVES(fitmac_controller_init(memory, fitmac_controller_size(), FITMAC_ABI_VERSION, config,
                                 &controller),
          FITMAC_STATUS_OK);
    free(config);
    return controller;
}

static fitmac_state_sample state_at(uint64_t n) {
    fitmac_state_sample state;
    memset(&state, 0, sizeof state);
    state.sequence = n;
    state.session = 1;
    state.stamp_ns = n * 1000000u;
    state.applied_command = n - 1;
    state.ee_position_m[0] = 0.375 + (double)n / 8192; /* exact: rounding has no say */
    state.ee_position_m[2] = 0.3;
    state.ee_orientation[1] = 1.0;
    state.gripper_width_m = 0.08;
    return state;
}

static fitmac_status tick(fitmac_controller *controller, uint64_t n, fitmac_output *output) {
    fitmac_state_sample state = state_at(n);
    fitmac_input input;
    memset(&input, 0, sizeof input);
    input.struct_size = sizeof input;
    input.state = &state;
    output->struct_size = sizeof *output;
    return fitmac_tick(controller, n * 1000000u, &input, output);
}

/* E8: wrong pointers, sizes and versions are statuses. */
static void wrong_arguments(void) {
    fitmac_config *config = NULL;
    size_t size = fitmac_config_size();
    _Alignas(16) unsigned char room[FITMAC_CONFIG_STORAGE + 16];
    GIVES(fitmac_config_init(NULL, size, NULL, &config), FITMAC_STATUS_NULL_POINTER);
    GIVES(fitmac_config_init(room + 1, size, NULL, &config), FITMAC_STATUS_MISALIGNED);
    GIVES(fitmac_config_init(room, size - 1, NULL, &config), FITMAC_STATUS_WRONG_SIZE);
    GIVES(fitmac_config_init(room, size, NULL, NULL), FITMAC_STATUS_NULL_POINTER);
    GIVES(fitmac_config_init(room, size, "brave", &config), FITMAC_STATUS_UNKNOWN_KEY);
    REQUIRE(config == NULL);
    memset(room, 0xa5, sizeof room);
    GIVES(fitmac_config_set((fitmac_config *)room, "gate.failure_streak", "3"),
          FITMAC_STATUS_NOT_INITIALISED);
    GIVES(fitmac_config_set(NULL, "gate.failure_streak", "3"), FITMAC_STATUS_NULL_POINTER);

    config = new_config();
    GIVES(fitmac_config_set(config, NULL, "3"), FITMAC_STATUS_NULL_POINTER);
    GIVES(fitmac_config_set(config, "gate.failure_streek", "3"), FITMAC_STATUS_UNKNOWN_KEY);
    GIVES(fitmac_config_set(config, "gate.failure_streak", "three"), FITMAC_STATUS_BAD_VALUE);
    GIVES(fitmac_config_set(config, "gate.failure_streak", "\xff"), FITMAC_STATUS_BAD_VALUE);
    char endless[400];
    memset(endless, 'k', sizeof endless); /* no NUL: it must not be read to its end */
    GIVES(fitmac_config_set(config, endless, "3"), FITMAC_STATUS_BAD_VALUE);
    uint32_t line = 99;
    const char *file = "profile = \"paper\"\n[gate]\nfailure_streek = 2\n";
    GIVES(fitmac_config_parse(config, file, strlen(file), &line), FITMAC_STATUS_UNKNOWN_KEY);
    REQUIRE(line == 3);
    GIVES(fitmac_config_parse(config, file, 1u << 20, NULL), FITMAC_STATUS_WRONG_SIZE);
    GIVES(fitmac_config_set(config, "gate.failure_streak", "0"), FITMAC_STATUS_OK);
    char message[200];
    GIVES(fitmac_config_check(config, message, sizeof message), FITMAC_STATUS_OUT_OF_RANGE);
    REQUIRE(strstr(message, "gate.failure_streak") != NULL);
    char cut[8];
    GIVES(fitmac_config_check(config, cut, sizeof cut), FITMAC_STATUS_OUT_OF_RANGE);
    REQUIRE(strlen(cut) == sizeof cut - 1);
    GIVES(fitmac_config_check(config, NULL, 100), FITMAC_STATUS_OUT_OF_RANGE);

    fitmac_controller *controller = NULL;
    size = fitmac_controller_size();
    REQUIRE(size <= FITMAC_CONTROLLER_STORAGE && fitmac_controller_alignment() == 16);
    unsigned char *memory = aligned_alloc(16, FITMAC_CONTROLLER_STORAGE + 16);
    GIVES(fitmac_controller_init(memory, size, FITMAC_ABI_VERSION, config, &controller),
          FITMAC_STATUS_OUT_OF_RANGE);
    GIVES(fitmac_config_set(config, "gate.failure_streak", "3"), FITMAC_STATUS_OK);
    GIVES(fitmac_config_check(config, message, sizeof message), FITMAC_STATUS_OK);
    REQUIRE(message[0] == '\0');
    GIVES(fitmac_controller_init(memory, size, FITMAC_ABI_VERSION + 1, config, &controller),
          FITMAC_STATUS_WRONG_VERSION);
    GIVES(fitmac_controller_init(NULL, size, FITMAC_ABI_VERSION, config, &controller),
          FITMAC_STATUS_NULL_POINTER);
    GIVES(fitmac_controller_init(memory + 8, size, FITMAC_ABI_VERSION, config, &controller),
          FITMAC_STATUS_MISALIGNED);
    GIVES(fitmac_controller_init(memory, size - 1, FITMAC_ABI_VERSION, config, &controller),
          FITMAC_STATUS_WRONG_SIZE);
    GIVES(fitmac_controller_init(memory, size, FITMAC_ABI_VERSION, NULL, &controller),
          FITMAC_STATUS_NULL_POINTER);
    GIVES(fitmac_controller_init(memory, size, FITMAC_ABI_VERSION, config, NULL),
          FITMAC_STATUS_NULL_POINTER);
    REQUIRE(controller == NULL);
    free(memory);
    free(config);

    controller = new_controller();
    fitmac_input input = {.struct_size = sizeof input};
    fitmac_output output = {.struct_size = sizeof output};
    GIVES(fitmac_tick(NULL, 1, &input, &output), FITMAC_STATUS_NULL_POINTER);
    GIVES(fitmac_tick(controller, 1, NULL, &output), FITMAC_STATUS_NULL_POINTER);
    GIVES(fitmac_tick(controller, 1, &input, NULL), FITMAC_STATUS_NULL_POINTER);
    GIVES(fitmac_tick((fitmac_controller *)((char *)controller + 4), 1, &input, &output),
          FITMAC_STATUS_MISALIGNED);
    input.struct_size -= 8;
    GIVES(fitmac_tick(controller, 1, &input, &output), FITMAC_STATUS_WRONG_SIZE);
    input.struct_size = sizeof input;
    output.struct_size = 0;
    GIVES(fitmac_tick(controller, 1, &input, &output), FITMAC_STATUS_WRONG_SIZE);
    output.struct_size = sizeof output;
    input.state = (const fitmac_state_sample *)((const char *)&output + 1);
    GIVES(fitmac_tick(controller, 1, &input, &output), FITMAC_STATUS_MISALIGNED);
    /* A structure that ends early is not read beyond its size field. */
    uint64_t *stub = malloc(sizeof *stub);
    *stub = sizeof *stub;
    GIVES(fitmac_tick(controller, 1, (const fitmac_input *)stub, &output),
          FITMAC_STATUS_WRONG_SIZE);
    GIVES(fitmac_tick(controller, 1, &input, (fitmac_output *)stub), FITMAC_STATUS_MISALIGNED);
    free(stub);
    GIVES(tick(controller, 1, &output), FITMAC_STATUS_OK);
    REQUIRE(output.command.sequence == 1); /* the refused calls decided nothing */
    GIVES(fitmac_controller_deinit(controller), FITMAC_STATUS_OK);
    GIVES(tick(controller, 2, &output), FITMAC_STATUS_NOT_INITIALISED);
    GIVES(fitmac_controller_deinit(controller), FITMAC_STATUS_NOT_INITIALISED);
    free(controller);
    puts("E8 arguments");
}

/* Messages of any content are the core's to judge: no status, no fault. */
static void any_bytes(void) {
    fitmac_controller *controller = new_controller();
    struct {
        fitmac_state_sample state;
        fitmac_action_chunk chunk;
        fitmac_grounding_record grounding;
        fitmac_plan plan;
        fitmac_verifier_report verifier;
        fitmac_critic_report critic;
    } all;
    uint64_t seed = 1;
    for (uint64_t n = 1; n <= 2000; n++) {
        for (size_t i = 0; i < sizeof all; i++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            ((unsigned char *)&all)[i] = n % 3 ? (unsigned char)(seed >> 56) : 0xff;
        }
        fitmac_input input = {sizeof input,  &all.state,    &all.chunk, &all.grounding,
                              &all.plan,     &all.verifier, &all.critic, (uint8_t)n, {0}};
        fitmac_output output = {.struct_size = sizeof output};
        GIVES(fitmac_tick(controller, n * 1000000u, &input, &output), FITMAC_STATUS_OK);
        for (int i = 0; i < FITMAC_ACTION_DIM; i++) {
            REQUIRE(output.command.action[i] >= -1.0 && output.command.action[i] <= 1.0);
        }
    }
    free(controller);
    puts("E8 any bytes");
}

/* E8: a snapshot continues as if nothing had been; other memory is refused. */
static void snapshots(void) {
    fitmac_controller *controller = new_controller();
    size_t size = fitmac_snapshot_size();
    REQUIRE(size <= FITMAC_SNAPSHOT_STORAGE);
    unsigned char *memory = aligned_alloc(fitmac_snapshot_alignment(), FITMAC_SNAPSHOT_STORAGE);
    fitmac_output first, again;
    memset(&first, 0, sizeof first);
    memset(&again, 0, sizeof again);
    memset(memory, 0, size);
    GIVES(fitmac_restore(controller, memory, size), FITMAC_STATUS_NOT_INITIALISED);
    GIVES(tick(controller, 1, &first), FITMAC_STATUS_OK);
    GIVES(fitmac_take_snapshot(controller, NULL, size), FITMAC_STATUS_NULL_POINTER);
    GIVES(fitmac_take_snapshot(controller, memory, size - 1), FITMAC_STATUS_WRONG_SIZE);
    GIVES(fitmac_take_snapshot(controller, memory + 8, size), FITMAC_STATUS_MISALIGNED);
    GIVES(fitmac_take_snapshot(controller, memory, size), FITMAC_STATUS_OK);
    GIVES(tick(controller, 2, &first), FITMAC_STATUS_OK);
    GIVES(tick(controller, 9, &again), FITMAC_STATUS_OK);
    GIVES(fitmac_restore(controller, memory, size - 1), FITMAC_STATUS_WRONG_SIZE);
    GIVES(fitmac_restore(controller, memory, size), FITMAC_STATUS_OK);
    GIVES(tick(controller, 2, &again), FITMAC_STATUS_OK);
    REQUIRE(memcmp(&first.command, &again.command, sizeof first.command) == 0);
    GIVES(fitmac_reset(controller), FITMAC_STATUS_OK);
    GIVES(tick(controller, 1, &again), FITMAC_STATUS_OK);
    REQUIRE(again.command.sequence == 1);
    GIVES(fitmac_reset(NULL), FITMAC_STATUS_NULL_POINTER);
    free(memory);
    free(controller);
    puts("E8 snapshots");
}

/* E9: many threads on one controller: each call is done or refused as busy. */
enum { THREADS = 4, CALLS = 4000 };

struct shared {
    fitmac_controller *controller;
    atomic_uint_fast64_t clock;
    atomic_uint done, busy;
};

static void *hammer(void *argument) {
    struct shared *shared = argument;
    fitmac_output output;
    for (int i = 0; i < CALLS; i++) {
        fitmac_status status = tick(shared->controller, ++shared->clock, &output);
        if (status == FITMAC_STATUS_OK) {
            shared->done++;
        } else {
            REQUIRE(status == FITMAC_STATUS_BUSY);
            shared->busy++;
            sched_yield();
        }
    }
    return NULL;
}

static void threads(void) {
    struct shared shared = {.controller = new_controller()};
    pthread_t thread[THREADS];
    for (int i = 0; i < THREADS; i++) {
        REQUIRE(pthread_create(&thread[i], NULL, hammer, &shared) == 0);
    }
    for (int i = 0; i < THREADS; i++) {
        REQUIRE(pthread_join(thread[i], NULL) == 0);
    }
    fitmac_output output;
    GIVES(tick(shared.controller, ++shared.clock, &output), FITMAC_STATUS_OK);
    /* Each call that was done counted one command, and no other did. */
    REQUIRE(output.command.sequence == shared.done + 1u);
    REQUIRE(shared.done + shared.busy == THREADS * CALLS);
    free(shared.controller);
    printf("E9 threads: %u done, %u busy\n", shared.done, shared.busy);
}

/* E10: the host's floating-point state changes no bit, is told, and stays. */
static uint64_t digest(uint32_t *seen) {
    fitmac_controller *controller = new_controller();
    uint64_t hash = 14695981039346656037u;
    for (uint64_t n = 1; n <= 300; n++) {
        fitmac_output output;
        GIVES(tick(controller, n, &output), FITMAC_STATUS_OK);
        *seen = output.float_state;
        for (size_t i = 0; i < sizeof output.command; i++) {
            hash = (hash ^ ((unsigned char *)&output.command)[i]) * 1099511628211u;
        }
    }
    free(controller);
    return hash;
}

static void float_state(void) {
    uint32_t seen = 99;
    REQUIRE(fitmac_float_state() == 0);
    uint64_t expected = digest(&seen);
    REQUIRE(seen == 0);
    REQUIRE(fesetround(FE_UPWARD) == 0);
    REQUIRE(fitmac_float_state() == FITMAC_FLOAT_ROUNDING);
    REQUIRE(digest(&seen) == expected);
    REQUIRE(seen == FITMAC_FLOAT_ROUNDING && fegetround() == FE_UPWARD);
    REQUIRE(fesetround(FE_TONEAREST) == 0);
#if defined(__x86_64__)
    unsigned control = _mm_getcsr();
    _mm_setcsr(control | 0x8040u);
    REQUIRE(fitmac_float_state() == (FITMAC_FLOAT_FLUSH_TO_ZERO | FITMAC_FLOAT_DENORMALS_ZERO));
    REQUIRE(digest(&seen) == expected);
    REQUIRE(seen == (FITMAC_FLOAT_FLUSH_TO_ZERO | FITMAC_FLOAT_DENORMALS_ZERO));
    REQUIRE((_mm_getcsr() & 0x8040u) == 0x8040u);
    _mm_setcsr(control);
    REQUIRE(feenableexcept(FE_INEXACT) != -1);
    REQUIRE(fitmac_float_state() == FITMAC_FLOAT_TRAPS);
    seen = 99;
    fitmac_controller *controller = new_controller();
    fitmac_output output;
    GIVES(tick(controller, 1, &output), FITMAC_STATUS_OK); /* inexact, and no trap */
    REQUIRE(output.float_state == FITMAC_FLOAT_TRAPS && fegetexcept() == FE_INEXACT);
    fedisableexcept(FE_ALL_EXCEPT);
    free(controller);
#endif
    puts("E10 floating point");
}

/* E11: a child has no controller; the parent keeps it. */
static void forks(void) {
    fitmac_controller *controller = new_controller();
    fitmac_output output;
    GIVES(tick(controller, 1, &output), FITMAC_STATUS_OK);
    pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        fitmac_status old = tick(controller, 2, &output);
        fitmac_status fresh = tick(new_controller(), 1, &output);
        _exit(old == FITMAC_STATUS_FORKED && fresh == FITMAC_STATUS_OK ? 0 : 1);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child && status == 0);
    GIVES(tick(controller, 2, &output), FITMAC_STATUS_OK);
    free(controller);
    puts("E11 fork");
}

static void names(void) {
    char name[32];
    GIVES(fitmac_name(FITMAC_VOCABULARY_ROUTE, FITMAC_ROUTE_TARGET_CORRECTION, name, sizeof name),
          FITMAC_STATUS_OK);
    REQUIRE(strcmp(name, "target_correction") == 0);
    GIVES(fitmac_name(FITMAC_VOCABULARY_REASON, 18, name, sizeof name), FITMAC_STATUS_OK);
    REQUIRE(strcmp(name, "strong_evidence") == 0 && FITMAC_REASON_STRONG_EVIDENCE == 1u << 18);
    GIVES(fitmac_name(FITMAC_VOCABULARY_MODE, 200, name, sizeof name), FITMAC_STATUS_UNKNOWN_KEY);
    GIVES(fitmac_name(99, 0, name, sizeof name), FITMAC_STATUS_UNKNOWN_KEY);
    GIVES(fitmac_name(FITMAC_VOCABULARY_MODE, 0, NULL, 9), FITMAC_STATUS_NULL_POINTER);
    REQUIRE(fitmac_abi_version() == FITMAC_ABI_VERSION && strlen(fitmac_version()) >= 5);
    for (uint32_t status = 0; status < 20; status++) {
        REQUIRE(strlen(fitmac_status_text(status)) > 0);
    }
    puts("names");
}

int main(void) {
    wrong_arguments();
    any_bytes();
    snapshots();
    threads();
    float_state();
    forks();
    names();
    return 0;
}
