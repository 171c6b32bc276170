/* fitmac.h - the C interface of the FIT-MAC decision core.
 *
 * Made from the Rust source by cbindgen: do not edit.
 *
 * Units are SI, positions are in the robot's base frame, quaternions are
 * (w, x, y, z), times are nanoseconds of one monotonic clock. Messages are
 * plain data without padding, the same in memory, in traces and in Rust.
 *
 * Nothing is allocated: objects live in memory of the caller, whose size and
 * alignment (16) are asked for, or given by the *_STORAGE constants. Every
 * function answers with a status; none throws or unwinds.
 *
 * FIT-MAC is not a safety function: keep the robot's own stops in place.
 */

#ifndef FITMAC_H
#define FITMAC_H

#include <stddef.h>
#include <stdint.h>

/* Sizes. */
#define FITMAC_ABI_VERSION 1
#define FITMAC_CHUNK_CAPACITY 64
#define FITMAC_ACTION_DIM 7
#define FITMAC_CANDIDATE_CAPACITY 16
#define FITMAC_OBJECT_CAPACITY 32
#define FITMAC_SUBTASK_CAPACITY 8
#define FITMAC_JOINT_COUNT 7
#define FITMAC_CONFIG_STORAGE 4096
#define FITMAC_CONTROLLER_STORAGE 32768
#define FITMAC_SNAPSHOT_STORAGE 32768

/* Flags of a command. */
#define FITMAC_COMMAND_CLAMPED 0x1u
#define FITMAC_COMMAND_LIMITED 0x2u
#define FITMAC_COMMAND_LAST 0x4u
#define FITMAC_COMMAND_FROM_POLICY 0x8u

/* The host's floating-point state: see fitmac_float_state(). */
#define FITMAC_FLOAT_FLUSH_TO_ZERO 0x1u
#define FITMAC_FLOAT_DENORMALS_ZERO 0x2u
#define FITMAC_FLOAT_ROUNDING 0x4u
#define FITMAC_FLOAT_TRAPS 0x8u

/* ActionSpace. */
#define FITMAC_ACTION_SPACE_OSC_POSE_DELTA 1

/* ActionFrame. */
#define FITMAC_ACTION_FRAME_BASE 1

/* GripperConvention. */
#define FITMAC_GRIPPER_CONVENTION_MINUS_ONE_OPEN 1
#define FITMAC_GRIPPER_CONVENTION_ONE_OPEN 2

/* GraspClass. */
#define FITMAC_GRASP_CLASS_BOX 1
#define FITMAC_GRASP_CLASS_CAN 2
#define FITMAC_GRASP_CLASS_BOTTLE 3
#define FITMAC_GRASP_CLASS_BOWL 4
#define FITMAC_GRASP_CLASS_FIXTURE 5

/* DestinationKind. */
#define FITMAC_DESTINATION_KIND_UNRESOLVED 0
#define FITMAC_DESTINATION_KIND_DIRECT 1
#define FITMAC_DESTINATION_KIND_RELATIONAL 2

/* PlaceRelation. */
#define FITMAC_PLACE_RELATION_ON 1
#define FITMAC_PLACE_RELATION_IN 2

/* Provenance. */
#define FITMAC_PROVENANCE_RULES 1
#define FITMAC_PROVENANCE_RESOLVER 2
#define FITMAC_PROVENANCE_RECHECK 3

/* Verdict. */
#define FITMAC_VERDICT_UNKNOWN 0
#define FITMAC_VERDICT_SUCCESS 1
#define FITMAC_VERDICT_FAIL 2

/* CriticLabel. */
#define FITMAC_CRITIC_LABEL_NONE 0
#define FITMAC_CRITIC_LABEL_TARGET_FAILURE 1
#define FITMAC_CRITIC_LABEL_EXECUTION_FAILURE 2
#define FITMAC_CRITIC_LABEL_SUCCESS 3

/* Request. */
#define FITMAC_REQUEST_NONE 0
#define FITMAC_REQUEST_STOP 1
#define FITMAC_REQUEST_RESET 2

/* Phase. */
#define FITMAC_PHASE_APPROACH 0
#define FITMAC_PHASE_GRASP 1
#define FITMAC_PHASE_LIFT 2
#define FITMAC_PHASE_TRANSPORT 3
#define FITMAC_PHASE_DESCEND 4
#define FITMAC_PHASE_RELEASE 5
#define FITMAC_PHASE_STABILISE 6
#define FITMAC_PHASE_COMPLETE 7

/* Diagnosis. */
#define FITMAC_DIAGNOSIS_NONE 0
#define FITMAC_DIAGNOSIS_TARGET_CORRECTION 1
#define FITMAC_DIAGNOSIS_PICK_FAILURE 2
#define FITMAC_DIAGNOSIS_PLACE_FAILURE 3
#define FITMAC_DIAGNOSIS_RECOVERY_IN_PROGRESS 4
#define FITMAC_DIAGNOSIS_SUCCESS 5

/* Route. */
#define FITMAC_ROUTE_BASE 0
#define FITMAC_ROUTE_EXECUTION_CORRECTION 1
#define FITMAC_ROUTE_TARGET_CORRECTION 2
#define FITMAC_ROUTE_PENDING_CORRECTION 3

/* Mode. */
#define FITMAC_MODE_NORMAL 0
#define FITMAC_MODE_WARN 1
#define FITMAC_MODE_HOLD 2
#define FITMAC_MODE_STOP 3

/* SubPhase. */
#define FITMAC_SUB_PHASE_IDLE 0
#define FITMAC_SUB_PHASE_SET_DOWN 1
#define FITMAC_SUB_PHASE_APPROACH_HOVER 2
#define FITMAC_SUB_PHASE_DESCEND 3
#define FITMAC_SUB_PHASE_CLOSE 4
#define FITMAC_SUB_PHASE_LIFT_TEST 5
#define FITMAC_SUB_PHASE_REOPEN 6
#define FITMAC_SUB_PHASE_LIFT_CARRY 7
#define FITMAC_SUB_PHASE_MOVE_ABOVE_DESTINATION 8
#define FITMAC_SUB_PHASE_DESCEND_TO_DESTINATION 9
#define FITMAC_SUB_PHASE_RELEASE_READY 10
#define FITMAC_SUB_PHASE_RELEASE_HOLD 11
#define FITMAC_SUB_PHASE_RETREAT 12
#define FITMAC_SUB_PHASE_SETTLE 13

/* EventKind. */
#define FITMAC_EVENT_KIND_QUERY 0
#define FITMAC_EVENT_KIND_CHUNK_REFUSED 1
#define FITMAC_EVENT_KIND_STATE_REFUSED 2
#define FITMAC_EVENT_KIND_GROUNDING_REFUSED 3
#define FITMAC_EVENT_KIND_MODE_CHANGED 4
#define FITMAC_EVENT_KIND_SUBTASK_CHANGED 5

/* Refusal. */
#define FITMAC_REFUSAL_SEQUENCE 0
#define FITMAC_REFUSAL_SESSION_CHANGED 1
#define FITMAC_REFUSAL_NOT_FINITE 2
#define FITMAC_REFUSAL_TOO_LONG 3
#define FITMAC_REFUSAL_EMPTY 4
#define FITMAC_REFUSAL_UNKNOWN_CODE 5
#define FITMAC_REFUSAL_CONVENTION 6
#define FITMAC_REFUSAL_OUT_OF_RANGE 7
#define FITMAC_REFUSAL_FROM_FUTURE 8
#define FITMAC_REFUSAL_TOO_OLD 9
#define FITMAC_REFUSAL_EPOCH 10
#define FITMAC_REFUSAL_SUBTASK 11
#define FITMAC_REFUSAL_QUERY 12
#define FITMAC_REFUSAL_CONSUMED 13
#define FITMAC_REFUSAL_QUATERNION 14
#define FITMAC_REFUSAL_IMPLAUSIBLE 15
#define FITMAC_REFUSAL_JUMP 16
#define FITMAC_REFUSAL_NOT_A_CANDIDATE 17
#define FITMAC_REFUSAL_BAD_PLAN 18
#define FITMAC_REFUSAL_REPEATED 19

/* Bits: reason. */
#define FITMAC_REASON_NO_STATE 0x1ull
#define FITMAC_REASON_STATE_STALE 0x2ull
#define FITMAC_REASON_STATE_REFUSED 0x4ull
#define FITMAC_REASON_COMMAND_NOT_APPLIED 0x8ull
#define FITMAC_REASON_NO_CHUNK 0x10ull
#define FITMAC_REASON_STARVED 0x20ull
#define FITMAC_REASON_CHUNK_REFUSED 0x40ull
#define FITMAC_REASON_CHUNK_REFUSALS 0x80ull
#define FITMAC_REASON_POLICY_RESTARTED 0x100ull
#define FITMAC_REASON_GROUNDING_REFUSED 0x200ull
#define FITMAC_REASON_ACTION_CLAMPED 0x400ull
#define FITMAC_REASON_TIME_FAULT 0x800ull
#define FITMAC_REASON_OPERATOR_STOP 0x1000ull
#define FITMAC_REASON_POLICY_FROZEN 0x2000ull
#define FITMAC_REASON_STATE_JUMP 0x4000ull
#define FITMAC_REASON_AWAITING_REBIND 0x8000ull
#define FITMAC_REASON_TARGET_STREAK 0x10000ull
#define FITMAC_REASON_EXECUTION_STREAK 0x20000ull
#define FITMAC_REASON_STRONG_EVIDENCE 0x40000ull
#define FITMAC_REASON_CORRECTION_PENDING 0x80000ull
#define FITMAC_REASON_INITIAL_GROUNDING 0x100000ull
#define FITMAC_REASON_STREAK_SHORT 0x1000000ull
#define FITMAC_REASON_CONFIDENCE_LOW 0x2000000ull
#define FITMAC_REASON_CONFIDENCE_STREAK_SHORT 0x4000000ull
#define FITMAC_REASON_ATTEMPT_YOUNG 0x8000000ull
#define FITMAC_REASON_PROGRESS 0x10000000ull
#define FITMAC_REASON_COOL_DOWN 0x20000000ull
#define FITMAC_REASON_BUDGET_SPENT 0x40000000ull
#define FITMAC_REASON_DESTINATION_INDIRECT 0x80000000ull
#define FITMAC_REASON_SWITCHED_OFF 0x100000000ull
#define FITMAC_REASON_NO_ACTION 0x200000000ull
#define FITMAC_REASON_VALIDITY_LOST 0x400000000ull
#define FITMAC_REASON_PHASE_INCOMPATIBLE 0x800000000ull
#define FITMAC_REASON_BUDGET_EXHAUSTED 0x1000000000ull
#define FITMAC_REASON_CORRECTED 0x2000000000ull
#define FITMAC_REASON_LIMITED 0x4000000000ull
#define FITMAC_REASON_SHUTTING_DOWN 0x8000000000ull
#define FITMAC_REASON_PLAN_UNCERTAIN 0x10000000000ull

/* Bits: evidence. */
#define FITMAC_EVIDENCE_PROGRESS 0x1ull
#define FITMAC_EVIDENCE_STALL 0x2ull
#define FITMAC_EVIDENCE_TIMEOUT 0x4ull
#define FITMAC_EVIDENCE_REVERSAL 0x8ull
#define FITMAC_EVIDENCE_WRONG_TARGET 0x10ull
#define FITMAC_EVIDENCE_MOVING_AWAY 0x20ull
#define FITMAC_EVIDENCE_EMPTY_GRASP 0x40ull
#define FITMAC_EVIDENCE_DROPPED 0x80ull
#define FITMAC_EVIDENCE_VERIFIER_NEGATIVE 0x100ull
#define FITMAC_EVIDENCE_KAPPA_LOW 0x200ull
#define FITMAC_EVIDENCE_LOCK_INCOMPATIBLE 0x400ull
#define FITMAC_EVIDENCE_LOCK_JUMPED 0x800ull
#define FITMAC_EVIDENCE_WRONG_OBJECT_HELD 0x1000ull
#define FITMAC_EVIDENCE_NO_LOCK 0x2000ull
#define FITMAC_EVIDENCE_CRITIC_TARGET 0x8000ull
#define FITMAC_EVIDENCE_CRITIC_EXECUTION 0x10000ull
#define FITMAC_EVIDENCE_MISPLACED 0x20000ull
#define FITMAC_EVIDENCE_WRONG_DESTINATION 0x40000ull
#define FITMAC_EVIDENCE_FLAPPING 0x80000ull


/**
 * What a call answers: 0 is success, all else an error that changed nothing.
 */
enum fitmac_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Done.
     */
    FITMAC_STATUS_OK = 0,
    /**
     * A pointer is NULL that must not be.
     */
    FITMAC_STATUS_NULL_POINTER = 1,
    /**
     * A pointer does not fit the alignment of what it points to.
     */
    FITMAC_STATUS_MISALIGNED = 2,
    /**
     * The memory is too small, or a structure has another size.
     */
    FITMAC_STATUS_WRONG_SIZE = 3,
    /**
     * Caller and library were built for different versions of this interface.
     */
    FITMAC_STATUS_WRONG_VERSION = 4,
    /**
     * The memory holds no such object: never initialised, retired, or moved.
     */
    FITMAC_STATUS_NOT_INITIALISED = 5,
    /**
     * Another thread, or this one further up, is inside a call on the object.
     */
    FITMAC_STATUS_BUSY = 6,
    /**
     * The process was forked: the controller belongs to the parent.
     */
    FITMAC_STATUS_FORKED = 7,
    /**
     * The library failed inside; the controller must be reset or initialised again.
     */
    FITMAC_STATUS_PANICKED = 8,
    /**
     * There is no such parameter or profile.
     */
    FITMAC_STATUS_UNKNOWN_KEY = 9,
    /**
     * The text is no value of the parameter's type, or no UTF-8, or too long.
     */
    FITMAC_STATUS_BAD_VALUE = 10,
    /**
     * The configuration's text is not `[stage]` and `key = value` lines.
     */
    FITMAC_STATUS_BAD_SYNTAX = 11,
    /**
     * Parameters are out of range or contradict each other.
     */
    FITMAC_STATUS_OUT_OF_RANGE = 12,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum fitmac_status fitmac_status;
#else
typedef uint32_t fitmac_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What a code is a member of.
 */
enum fitmac_vocabulary
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * `FITMAC_MODE_*`.
     */
    FITMAC_VOCABULARY_MODE = 0,
    /**
     * `FITMAC_ROUTE_*`.
     */
    FITMAC_VOCABULARY_ROUTE = 1,
    /**
     * `FITMAC_PHASE_*`.
     */
    FITMAC_VOCABULARY_PHASE = 2,
    /**
     * `FITMAC_SUB_PHASE_*`.
     */
    FITMAC_VOCABULARY_SUB_PHASE = 3,
    /**
     * `FITMAC_DIAGNOSIS_*`.
     */
    FITMAC_VOCABULARY_DIAGNOSIS = 4,
    /**
     * `FITMAC_EVENT_KIND_*`.
     */
    FITMAC_VOCABULARY_EVENT_KIND = 5,
    /**
     * `FITMAC_VERDICT_*`.
     */
    FITMAC_VOCABULARY_VERDICT = 6,
    /**
     * The number of a bit of `FITMAC_REASON_*`: 0 to 63.
     */
    FITMAC_VOCABULARY_REASON = 7,
    /**
     * The number of a bit of `FITMAC_EVIDENCE_*`: 0 to 63.
     */
    FITMAC_VOCABULARY_EVIDENCE = 8,
    /**
     * `detail` of a record of a refused message.
     */
    FITMAC_VOCABULARY_REFUSAL = 9,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum fitmac_vocabulary fitmac_vocabulary;
#else
typedef uint32_t fitmac_vocabulary;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The parameters of a controller: an opaque value. It may be copied.
 */
typedef struct fitmac_config fitmac_config;

/**
 * A controller: an opaque object. It may not be moved or copied.
 */
typedef struct fitmac_controller fitmac_controller;

/**
 * An object's identity within an episode; 0 names no object.
 */
typedef uint16_t fitmac_object_id;

/**
 * One object as the pose source sees it.
 */
typedef struct fitmac_object_sample {
    /**
     * Identity within the episode; 0 is invalid.
     */
    fitmac_object_id id;
    /**
     * `FITMAC_GRASP_CLASS_*`.
     */
    uint8_t grasp_class;
    /**
     * 1 if the object was observed in this sample, 0 if the pose is kept.
     */
    uint8_t visible;
    /**
     * Zero.
     */
    uint32_t reserved;
    /**
     * When the pose was observed, ns.
     */
    uint64_t stamp_ns;
    /**
     * Centre of the bounding box, base frame, m.
     */
    double position_m[3];
    /**
     * Orientation in the base frame, unit quaternion (w, x, y, z).
     */
    double orientation[4];
    /**
     * Half the bounding box along the object's own axes, m.
     */
    double half_extent_m[3];
    /**
     * Confidence of the pose, 0 to 1.
     */
    double confidence;
} fitmac_object_sample;

/**
 * The state of the robot and of the objects around it.
 */
typedef struct fitmac_state_sample {
    /**
     * Rises by one with each new sample; a repeated number is a repeated sample.
     */
    uint64_t sequence;
    /**
     * Names the run of the publisher; a change means that it restarted.
     */
    uint64_t session;
    /**
     * When the sample was taken, ns.
     */
    uint64_t stamp_ns;
    /**
     * The sequence number of the last command that the robot applied.
     */
    uint64_t applied_command;
    /**
     * Joint positions, rad.
     */
    double joint_position_rad[FITMAC_JOINT_COUNT];
    /**
     * Joint velocities, rad/s.
     */
    double joint_velocity_rad_s[FITMAC_JOINT_COUNT];
    /**
     * Tool centre point, base frame, m.
     */
    double ee_position_m[3];
    /**
     * Orientation of the end effector, unit quaternion (w, x, y, z).
     */
    double ee_orientation[4];
    /**
     * Linear velocity of the tool centre point, base frame, m/s.
     */
    double ee_velocity_m_s[3];
    /**
     * Distance between the finger pads, m (Franka Hand: 0 to 0.08).
     */
    double gripper_width_m;
    /**
     * Objects in use.
     */
    uint32_t object_count;
    /**
     * Zero.
     */
    uint32_t reserved;
    /**
     * The objects; only the first `object_count` count.
     */
    struct fitmac_object_sample objects[FITMAC_OBJECT_CAPACITY];
} fitmac_state_sample;

/**
 * A chunk of actions from the policy.
 */
typedef struct fitmac_action_chunk {
    /**
     * Rises with each chunk of a session.
     */
    uint64_t sequence;
    /**
     * Names the run of the publisher; a change means that it restarted.
     */
    uint64_t session;
    /**
     * When the observation behind the chunk was taken, ns.
     */
    uint64_t observation_ns;
    /**
     * When the chunk was produced, ns.
     */
    uint64_t stamp_ns;
    /**
     * The query that the chunk answers.
     */
    uint64_t query_id;
    /**
     * The grounding epoch of the prompt that the chunk answers.
     */
    uint64_t epoch;
    /**
     * The subtask of that prompt.
     */
    uint32_t subtask;
    /**
     * The prompt.
     */
    uint32_t prompt_id;
    /**
     * Actions in use; a count above the capacity refuses the whole chunk.
     */
    uint32_t horizon;
    /**
     * `FITMAC_ACTION_SPACE_*`.
     */
    uint8_t action_space;
    /**
     * `FITMAC_ACTION_FRAME_*`.
     */
    uint8_t frame;
    /**
     * `FITMAC_GRIPPER_CONVENTION_*`.
     */
    uint8_t gripper;
    /**
     * Zero.
     */
    uint8_t reserved;
    /**
     * The actions, one a policy step; only the first `horizon` count.
     */
    float actions[FITMAC_CHUNK_CAPACITY][FITMAC_ACTION_DIM];
} fitmac_action_chunk;

/**
 * One object that may be meant by the instruction.
 */
typedef struct fitmac_candidate {
    /**
     * The object.
     */
    fitmac_object_id id;
    /**
     * 1 if its class and relation fit the instruction.
     */
    uint8_t compatible;
    /**
     * Zero.
     */
    uint8_t reserved[5];
    /**
     * How well it fits, 0 to 1.
     */
    double confidence;
} fitmac_candidate;

/**
 * What the grounder knows about the target and destination of a subtask.
 */
typedef struct fitmac_grounding_record {
    /**
     * Rises with each record of a session.
     */
    uint64_t sequence;
    /**
     * Names the run of the publisher.
     */
    uint64_t session;
    /**
     * When the observation behind the record was taken, ns.
     */
    uint64_t stamp_ns;
    /**
     * Rises with each resolution that may move the lock.
     */
    uint64_t epoch;
    /**
     * The subtask that it grounds.
     */
    uint32_t subtask;
    /**
     * The prompt that names the target to the policy.
     */
    uint32_t prompt_id;
    /**
     * The chosen target; 0 if none was found.
     */
    fitmac_object_id target;
    /**
     * The destination's anchor object; 0 if it has none.
     */
    fitmac_object_id destination;
    /**
     * `FITMAC_DESTINATION_KIND_*`.
     */
    uint8_t destination_kind;
    /**
     * `FITMAC_PLACE_RELATION_*`.
     */
    uint8_t relation;
    /**
     * `FITMAC_PROVENANCE_*`.
     */
    uint8_t provenance;
    /**
     * Candidates in use; a count above the capacity refuses the record.
     */
    uint8_t candidate_count;
    /**
     * Confidence kappa of the target, 0 to 1.
     */
    double confidence;
    /**
     * Centre of the destination region in the anchor's frame, m: on a
     * surface, its z is the surface; in a container, its z is the rim.
     */
    double region_offset_m[3];
    /**
     * Half extent of the destination region in x and y of the anchor, and the
     * depth of a container (0 on a surface), m.
     */
    double region_half_extent_m[3];
    /**
     * The target in the image: x, y, width, height, px. For the trace only.
     */
    float image_box_px[4];
    /**
     * The candidates.
     */
    struct fitmac_candidate candidates[FITMAC_CANDIDATE_CAPACITY];
} fitmac_grounding_record;

/**
 * The ordered subtasks of an instruction.
 */
typedef struct fitmac_plan {
    /**
     * Names the plan; a new number starts a new episode of decisions.
     */
    uint64_t id;
    /**
     * Subtasks in use, 1 to `FITMAC_SUBTASK_CAPACITY`.
     */
    uint32_t subtask_count;
    /**
     * Confidence of the parse in 1/1000; below the core's threshold the base
     * policy keeps control.
     */
    uint32_t confidence_permille;
} fitmac_plan;

/**
 * The task verifier's word on the active subtask.
 */
typedef struct fitmac_verifier_report {
    /**
     * Rises with each report.
     */
    uint64_t sequence;
    /**
     * When it was judged, ns.
     */
    uint64_t stamp_ns;
    /**
     * The subtask that it judges.
     */
    uint32_t subtask;
    /**
     * `FITMAC_VERDICT_*`.
     */
    uint8_t verdict;
    /**
     * Zero.
     */
    uint8_t reserved[3];
} fitmac_verifier_report;

/**
 * The critic's assessment of the execution snapshot.
 */
typedef struct fitmac_critic_report {
    /**
     * Rises with each report.
     */
    uint64_t sequence;
    /**
     * When the snapshot was taken, ns.
     */
    uint64_t stamp_ns;
    /**
     * The subtask that it judges.
     */
    uint32_t subtask;
    /**
     * `FITMAC_CRITIC_LABEL_*`.
     */
    uint8_t label;
    /**
     * Zero.
     */
    uint8_t reserved[3];
    /**
     * Confidence, clamped to [0, 1] by the intake.
     */
    double confidence;
} fitmac_critic_report;

/**
 * Everything that arrived since the last tick. NULL means nothing new.
 */
typedef struct fitmac_input {
    /**
     * `sizeof(fitmac_input)`.
     */
    uint64_t struct_size;
    /**
     * The newest robot state.
     */
    const struct fitmac_state_sample *state;
    /**
     * The newest action chunk.
     */
    const struct fitmac_action_chunk *chunk;
    /**
     * The newest grounding record.
     */
    const struct fitmac_grounding_record *grounding;
    /**
     * The plan, at the start of an episode.
     */
    const struct fitmac_plan *plan;
    /**
     * The newest word of the task verifier.
     */
    const struct fitmac_verifier_report *verifier;
    /**
     * The newest word of the critic.
     */
    const struct fitmac_critic_report *critic;
    /**
     * A request of the operator: `FITMAC_REQUEST_*`.
     */
    uint8_t request;
    /**
     * Zero.
     */
    uint8_t reserved[7];
} fitmac_input;

/**
 * One action in the declared action space.
 */
typedef double fitmac_action[FITMAC_ACTION_DIM];

/**
 * The command of one control tick.
 *
 * A robot takes it in one of two ways. A LIBERO-like plant takes `action`
 * each time `policy_step` rises: its goal becomes the measured pose plus the
 * increment. A robot with a Cartesian interface at control rate follows
 * `setpoint_*`, which is shaped to the limits on velocity, acceleration and
 * jerk at every tick.
 */
typedef struct fitmac_command {
    /**
     * Rises by one each tick.
     */
    uint64_t sequence;
    /**
     * The time that the tick was told, ns.
     */
    uint64_t stamp_ns;
    /**
     * Rises by one each time a new action starts; an action stands until the
     * next one starts.
     */
    uint64_t policy_step;
    /**
     * The query in which the action was decided.
     */
    uint64_t query;
    /**
     * Normalised increments (x, y, z, rotation vector) in [-1, 1], and the
     * gripper: -1 opens, +1 closes.
     */
    fitmac_action action;
    /**
     * Setpoint of the tool centre point, base frame, m.
     */
    double setpoint_position_m[3];
    /**
     * Its velocity, m/s.
     */
    double setpoint_velocity_m_s[3];
    /**
     * Its acceleration, m/s^2.
     */
    double setpoint_acceleration_m_s2[3];
    /**
     * Setpoint of the orientation, unit quaternion (w, x, y, z).
     */
    double setpoint_orientation[4];
    /**
     * Why the mode or the route is not the plain one: bits of `FITMAC_REASON_*`.
     */
    uint64_t reasons;
    /**
     * `FITMAC_MODE_*`.
     */
    uint8_t mode;
    /**
     * `FITMAC_ROUTE_*`.
     */
    uint8_t route;
    /**
     * `FITMAC_PHASE_*`.
     */
    uint8_t phase;
    /**
     * `FITMAC_SUB_PHASE_*`.
     */
    uint8_t sub_phase;
    /**
     * Bits of `FITMAC_COMMAND_CLAMPED` and its neighbours.
     */
    uint32_t flags;
} fitmac_command;

/**
 * Asks the policy for a chunk.
 */
typedef struct fitmac_policy_query {
    /**
     * Names the query; the chunk repeats it.
     */
    uint64_t query_id;
    /**
     * When it was asked, ns.
     */
    uint64_t stamp_ns;
    /**
     * The sequence number of the state sample that the core decided on.
     */
    uint64_t state_sequence;
    /**
     * Policy steps executed so far in this episode.
     */
    uint64_t policy_step;
    /**
     * The committed grounding epoch; the chunk repeats it.
     */
    uint64_t epoch;
    /**
     * The active subtask; the chunk repeats it.
     */
    uint32_t subtask;
    /**
     * The prompt to use; the chunk repeats it.
     */
    uint32_t prompt_id;
} fitmac_policy_query;

/**
 * Asks the agents to ground the target (again).
 */
typedef struct fitmac_rebind_request {
    /**
     * Names the request.
     */
    uint64_t request_id;
    /**
     * When it was asked, ns.
     */
    uint64_t stamp_ns;
    /**
     * The answer's epoch must be above this one.
     */
    uint64_t epoch;
    /**
     * The subtask to ground.
     */
    uint32_t subtask;
    /**
     * The instance that is in doubt; 0 if none was locked.
     */
    fitmac_object_id suspect;
    /**
     * Zero.
     */
    uint16_t reserved;
    /**
     * Why: bits of `FITMAC_REASON_*`.
     */
    uint64_t reasons;
} fitmac_rebind_request;

/**
 * One record a query, and one an event: what the core saw and decided.
 */
typedef struct fitmac_trace_record {
    /**
     * When, ns.
     */
    uint64_t stamp_ns;
    /**
     * The query.
     */
    uint64_t query;
    /**
     * Policy steps executed so far.
     */
    uint64_t policy_step;
    /**
     * Evidence at hand: bits of `FITMAC_EVIDENCE_*`.
     */
    uint64_t evidence;
    /**
     * Gate reasons and faults: bits of `FITMAC_REASON_*`.
     */
    uint64_t reasons;
    /**
     * Committed grounding epoch.
     */
    uint64_t epoch;
    /**
     * Attempt number within the episode.
     */
    uint64_t attempt;
    /**
     * Policy steps in the phase.
     */
    uint32_t phase_steps;
    /**
     * Queries left to the running recovery.
     */
    uint32_t budget;
    /**
     * Actions that this query may execute.
     */
    uint32_t effective_horizon;
    /**
     * Policy steps since the attempt began.
     */
    uint32_t attempt_steps;
    /**
     * Active subtask.
     */
    uint32_t subtask;
    /**
     * For a refused message: its reason as the code of the refusal.
     */
    uint32_t detail;
    /**
     * The locked target; 0 if none.
     */
    fitmac_object_id target;
    /**
     * The object that the arm approaches or holds instead; 0 if none.
     */
    fitmac_object_id other;
    /**
     * `FITMAC_EVENT_KIND_*`.
     */
    uint8_t kind;
    /**
     * `FITMAC_PHASE_*`.
     */
    uint8_t phase;
    /**
     * `FITMAC_DIAGNOSIS_*`.
     */
    uint8_t diagnosis;
    /**
     * `FITMAC_ROUTE_*`.
     */
    uint8_t route;
    /**
     * `FITMAC_MODE_*`.
     */
    uint8_t mode;
    /**
     * `FITMAC_SUB_PHASE_*`.
     */
    uint8_t sub_phase;
    /**
     * `FITMAC_VERDICT_*`.
     */
    uint8_t verdict;
    /**
     * Consecutive actionable failures of one type.
     */
    uint8_t failure_streak;
    /**
     * Consecutive observations of the target above the gate's confidence.
     */
    uint8_t confidence_streak;
    /**
     * Re-descents left to the running recovery.
     */
    uint8_t redescents;
    /**
     * 1 if the gripper is closed.
     */
    uint8_t gripper_closed;
    /**
     * 1 if the target is lifted.
     */
    uint8_t lifted;
    /**
     * Confidence of the lock.
     */
    double kappa;
    /**
     * End effector to target, m; NaN if unknown.
     */
    double target_distance_m;
    /**
     * Object to destination, m; NaN if unknown.
     */
    double destination_distance_m;
    /**
     * Gripper width, m.
     */
    double gripper_width_m;
    /**
     * Tool centre point, base frame, m.
     */
    double ee_position_m[3];
    /**
     * The target, base frame, m; NaN if unknown.
     */
    double target_position_m[3];
    /**
     * The recovery's waypoint, base frame, m; NaN if none.
     */
    double waypoint_m[3];
    /**
     * The base policy's action for this step; NaN if none was at hand.
     */
    fitmac_action base_action;
    /**
     * The action that was executed.
     */
    fitmac_action action;
} fitmac_trace_record;

/**
 * The answer to one tick. What the `has_` flags do not announce is left as it
 * was.
 */
typedef struct fitmac_output {
    /**
     * `sizeof(fitmac_output)`, set by the caller.
     */
    uint64_t struct_size;
    /**
     * How the host computes that is not IEEE 754's default: bits of
     * `FITMAC_FLOAT_*`. The tick computed by the default nevertheless.
     */
    uint32_t float_state;
    /**
     * 1 if `query` was written: a request for an action chunk, to be sent to
     * the policy.
     */
    uint8_t has_query;
    /**
     * 1 if `rebind` was written: a request to ground the target, to be sent to
     * the agents.
     */
    uint8_t has_rebind;
    /**
     * 1 if `trace` was written: the record of a query whose first action
     * starts in this tick.
     */
    uint8_t has_trace;
    /**
     * 1 if `event` was written: the record of a refusal or a change of mode.
     */
    uint8_t has_event;
    /**
     * The command for the robot; exactly one a tick.
     */
    struct fitmac_command command;
    /**
     * See `has_query`.
     */
    struct fitmac_policy_query query;
    /**
     * See `has_rebind`.
     */
    struct fitmac_rebind_request rebind;
    /**
     * See `has_trace`.
     */
    struct fitmac_trace_record trace;
    /**
     * See `has_event`.
     */
    struct fitmac_trace_record event;
} fitmac_output;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The version of the interface that the library speaks: `FITMAC_ABI_VERSION`
 * of the header that it was built with.
 */
uint32_t fitmac_abi_version(void);

/**
 * The version of the library, as text like `0.1.0`.
 */
const char *fitmac_version(void);

/**
 * Bytes that a `fitmac_config` takes.
 */
size_t fitmac_config_size(void);

/**
 * Alignment of a `fitmac_config`, bytes.
 */
size_t fitmac_config_alignment(void);

/**
 * Makes a configuration in `memory`, which has `size` bytes, with the values
 * of `profile`: "guarded" (do no harm; also for NULL) or "paper" (as
 * published). `config` gets the object's address, which is `memory`'s.
 *
 * The caller's part:
 * Pointers that are not NULL point to memory of the said size; `profile` ends
 * with a NUL.
 */
fitmac_status fitmac_config_init(void *memory,
                                 size_t size,
                                 const char *profile,
                                 struct fitmac_config **config);

/**
 * Sets one parameter: `key` like "gate.failure_streak", `value` like "3",
 * "0.25", "false" or "refuse". Ranges are checked by `fitmac_config_check` and
 * `fitmac_controller_init`.
 *
 * The caller's part:
 * `config` is a configuration that no other thread uses now; the texts end
 * with a NUL.
 */
fitmac_status fitmac_config_set(struct fitmac_config *config, const char *key, const char *value);

/**
 * Reads the text of a configuration file: `profile = "paper"`, `[gate]`,
 * `failure_streak = 3`. What it does not name keeps its value; on an error
 * nothing changes, and `line`, if not NULL, gets the line (from 1).
 *
 * The caller's part:
 * `config` is a configuration that no other thread uses now; `text` has
 * `length` bytes.
 */
fitmac_status fitmac_config_parse(struct fitmac_config *config,
                                  const char *text,
                                  size_t length,
                                  uint32_t *line);

/**
 * Checks every parameter and the relations between them. If some do not hold,
 * `message`, if not NULL, gets all their names, values and ranges, cut to
 * `size` bytes with the NUL.
 *
 * The caller's part:
 * `config` is a configuration that no other thread changes now; `message` has
 * room for `size` bytes.
 */
fitmac_status fitmac_config_check(const struct fitmac_config *config, char *message, size_t size);

/**
 * Bytes that a `fitmac_controller` takes; at most `FITMAC_CONTROLLER_STORAGE`.
 */
size_t fitmac_controller_size(void);

/**
 * Alignment of a `fitmac_controller`, bytes.
 */
size_t fitmac_controller_alignment(void);

/**
 * Makes a controller in `memory`, which has `size` bytes and which nobody else
 * uses meanwhile. `abi_version` is `FITMAC_ABI_VERSION`, as the caller was
 * compiled with. `controller` gets the object's address, which is `memory`'s.
 *
 * The caller's part:
 * Pointers that are not NULL point to memory of the said size; `config` is a
 * configuration.
 */
fitmac_status fitmac_controller_init(void *memory,
                                     size_t size,
                                     uint32_t abi_version,
                                     const struct fitmac_config *config,
                                     struct fitmac_controller **controller);

/**
 * Retires a controller: later calls on it are refused. There is nothing to
 * free; this only turns a use after the end into an error.
 *
 * The caller's part:
 * `controller` is a controller, or memory of its size.
 */
fitmac_status fitmac_controller_deinit(struct fitmac_controller *controller);

/**
 * Makes a controller as new: it forgets everything but its parameters. (To
 * start another episode, send `FITMAC_REQUEST_RESET` with a tick.)
 *
 * The caller's part:
 * `controller` is a controller, or memory of its size.
 */
fitmac_status fitmac_reset(struct fitmac_controller *controller);

/**
 * Bytes that a `fitmac_snapshot` takes.
 */
size_t fitmac_snapshot_size(void);

/**
 * Alignment of a `fitmac_snapshot`, bytes.
 */
size_t fitmac_snapshot_alignment(void);

/**
 * Writes what the controller remembers into `memory`, which has `size` bytes.
 *
 * The caller's part:
 * `controller` is a controller, or memory of its size; `memory` is used by
 * nobody else.
 */
fitmac_status fitmac_take_snapshot(struct fitmac_controller *controller, void *memory, size_t size);

/**
 * Goes on from a snapshot of a controller with the same parameters. Bytes that
 * no `fitmac_take_snapshot` of this process wrote are refused as far as
 * their stamp shows it; don't load snapshots from files: replay a trace.
 *
 * The caller's part:
 * `controller` is a controller, or memory of its size; `memory` has `size`
 * bytes.
 */
fitmac_status fitmac_restore(struct fitmac_controller *controller, const void *memory, size_t size);

/**
 * How the calling thread computes: bits of `FITMAC_FLOAT_*`, 0 for IEEE 754's
 * default. Calls compute by the default in any case and put this state back.
 */
uint32_t fitmac_float_state(void);

/**
 * Writes the name of `code`, a member of `vocabulary` (`FITMAC_VOCABULARY_*`), as
 * traces and tables show it; at most `size` bytes with the NUL.
 *
 * The caller's part:
 * `name` has room for `size` bytes.
 */
fitmac_status fitmac_name(uint32_t vocabulary, uint32_t code, char *name, size_t size);

/**
 * What a status means, as text that lives as long as the program. Any number
 * has a text.
 */
const char *fitmac_status_text(uint32_t status);

/**
 * Decides one control tick at `now_ns`, nanoseconds of a monotonic clock.
 * Whatever the messages hold, one command comes out; an error means that the
 * call itself was wrong: nothing was decided, and the robot is to be stopped.
 *
 * Messages are read, not kept. Nothing is allocated, locked or asked of the
 * operating system.
 *
 * The caller's part:
 * `controller` is a controller, or memory of its size; every pointer that is
 * not NULL points to its type; no other thread writes to the messages or uses
 * `output` meanwhile.
 */
fitmac_status fitmac_tick(struct fitmac_controller *controller,
                          uint64_t now_ns,
                          const struct fitmac_input *input,
                          struct fitmac_output *output);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* FITMAC_H */
