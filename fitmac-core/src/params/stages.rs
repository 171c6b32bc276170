//! The parameters, stage by stage. "The paper" is the FIT-MAC paper; a default
//! without a source is ours.

use super::stage::stage;

stage! {
    /// Clocks: how often the policy acts, and what a gap in time means.
    Clock "clock" {
        /// Duration of one policy step: one action of a chunk (LIBERO: 20 Hz).
        step_ms: u32 = 50 in 10..=1000, "ms";
        /// Policy steps of standing still with an open gripper before the first query, while objects settle (OpenVLA-OFT's LIBERO evaluation).
        settle_steps: u32 = 10 in 0..=100, "steps";
        /// A gap between ticks above this is a suspended controller: stop.
        gap_stop_ms: u32 = 250 in 10..=5000, "ms";
    }
}

stage! {
    /// What makes a state sample acceptable, and what its absence leads to.
    StateIntake "state" {
        /// Older than this: hold.
        hold_age_ms: u32 = 60 in 1..=1000, "ms";
        /// Older than this: stop.
        stop_age_ms: u32 = 500 in 2..=10000, "ms";
        /// A stamp further in the future than this is refused.
        future_skew_ms: u32 = 5 in 0..=1000, "ms";
        /// No coordinate of a pose lies further out; beyond it the unit is wrong.
        plausible_position_m: f64 = 3.0 in 0.5..=20.0, "m";
        /// Speed that a real end effector or object cannot exceed between samples.
        jump_speed_m_s: f64 = 4.0 in 0.5..=50.0, "m/s";
        /// Distance always allowed between samples, for noise and late frames.
        jump_margin_m: f64 = 0.03 in 0.001..=0.5, "m";
        /// Jumping samples in a row that are dropped before the new place is believed.
        jump_samples: u32 = 5 in 1..=100, "samples";
        /// A command that the robot does not apply for this long: hold.
        applied_hold_ms: u32 = 500 in 10..=5000, "ms";
    }
}

stage! {
    /// What makes an action chunk acceptable, and what its absence leads to.
    ChunkIntake "chunk" {
        /// Actions that may be executed open loop (H_open-loop of equation 12).
        open_loop_steps: u32 = 8 in 1..=64, "steps";
        /// Chunks whose observation is older than this are refused.
        max_age_ms: u32 = 2000 in 20..=60000, "ms";
        /// A chunk from further in the future than this is refused.
        future_skew_ms: u32 = 5 in 0..=1000, "ms";
        /// An answer that takes longer than this: hold.
        hold_after_ms: u32 = 1000 in 10..=60000, "ms";
        /// An answer that takes longer than this: stop. Counted after the first accepted chunk only, for models load slowly.
        stop_after_ms: u32 = 10000 in 20..=600000, "ms";
        /// The question is asked this many policy steps before the queue runs empty; the steps executed meanwhile are dropped from the answer.
        query_lead_steps: u32 = 0 in 0..=16, "steps";
        /// Refused chunks in a row before the controller holds.
        refusals_hold: u32 = 2 in 1..=100, "chunks";
        /// Refused chunks in a row before the controller stops.
        refusals_stop: u32 = 20 in 2..=10000, "chunks";
        /// Equal chunks in a row that count as a frozen policy.
        frozen_chunks: u32 = 5 in 2..=1000, "chunks";
        /// How far outside [-1, 1] an action may be before its chunk is refused, where `out_of_range` says so.
        range_tolerance: f64 = 1e-6 in 0.0..=0.5, "1";
    }
}

stage! {
    /// The action space of policy and robot (LIBERO's OSC_POSE).
    ActionScale "action" {
        /// Translation of one unit.
        translation_m: f64 = 0.05 in 0.001..=0.5, "m";
        /// Rotation of one unit.
        rotation_rad: f64 = 0.5 in 0.01..=3.2, "rad";
        /// Divisor of equation 8 in x and y.
        recovery_divisor_xy_m: f64 = 0.045 in 0.001..=0.5, "m";
        /// Divisor of equation 8 in z.
        recovery_divisor_z_m: f64 = 0.035 in 0.001..=0.5, "m";
    }
}

stage! {
    /// The gripper (Franka Hand).
    Gripper "gripper" {
        /// Width when fully open.
        open_width_m: f64 = 0.08 in 0.01..=0.5, "m";
        /// Below this share of the open width, and not opening, it is closed.
        closed_ratio: f64 = 0.85 in 0.1..=0.99, "1";
        /// Change of width in one policy step that counts as moving.
        moving_m: f64 = 0.001 in 0.00001..=0.02, "m";
        /// Closed narrower than this, it holds nothing.
        empty_width_m: f64 = 0.010 in 0.0..=0.1, "m";
        /// The same where a thing with thin walls is at hand: a bowl's rim is 3 to 6 mm.
        empty_thin_width_m: f64 = 0.002 in 0.0..=0.05, "m";
        /// An object this close to the tool centre point and moving with it is held.
        held_radius_m: f64 = 0.10 in 0.01..=0.3, "m";
    }
}

stage! {
    /// Steadying of object poses.
    Tracking "tracking" {
        /// Share of the way to each new observation (1: none is steadied).
        gain: f64 = 0.35 in 0.01..=1.0, "1";
        /// A change beyond this is motion, and is taken at once.
        jump_m: f64 = 0.04 in 0.001..=0.5, "m";
    }
}

stage! {
    /// Phase estimation (section 3.4 of the paper names the signals).
    PhaseParams "phase" {
        /// Open and further than this from the target: approach.
        approach_distance_m: f64 = 0.06 in 0.005..=0.5, "m";
        /// Horizontally nearer than this to the target: grasp.
        grasp_xy_m: f64 = 0.03 in 0.005..=0.2, "m";
        /// End effector lower than this above the target: grasp.
        grasp_height_m: f64 = 0.10 in 0.005..=0.5, "m";
        /// Rise of the target that counts as lifted.
        lifted_m: f64 = 0.04 in 0.005..=0.5, "m";
        /// Horizontally nearer than this to the destination: descend.
        descend_xy_m: f64 = 0.03 in 0.005..=0.3, "m";
        /// Object's underside lower than this above the surface: descend (Table 19 keeps transport until the object is low).
        descend_clearance_m: f64 = 0.06 in 0.005..=0.5, "m";
        /// Steps that a new phase or a lift must persist.
        hysteresis_steps: u32 = 2 in 1..=20, "steps";
    }
}

stage! {
    /// Progress (equations 3 and 5).
    Progress "progress" {
        /// Delta: steps over which a change is measured (equation 3).
        delta_steps: u32 = 4 in 1..=8, "steps";
        /// tau_tgt: approach to the target that is progress.
        target_m: f64 = 0.005 in 0.0001..=0.2, "m";
        /// tau_ee: motion of the end effector that is progress in a pick.
        end_effector_m: f64 = 0.008 in 0.0001..=0.2, "m";
        /// tau_dst: approach to the destination that is progress.
        destination_m: f64 = 0.005 in 0.0001..=0.2, "m";
        /// tau_obj: motion of the object that is progress in a place.
        object_m: f64 = 0.008 in 0.0001..=0.2, "m";
        /// Turns back within the reversal window that count as oscillation; the disjunction in equation 5 calls an oscillating arm progress. 0 turns the monitor off.
        reversals: u32 = 6 in 0..=64, "turns";
        /// The reversal window.
        reversal_window_steps: u32 = 24 in 4..=64, "steps";
        /// Net approach within the window below which turning back is oscillation.
        reversal_net_m: f64 = 0.02 in 0.001..=0.5, "m";
    }
}

stage! {
    /// Patience W of each phase: steps without progress that are a stall (equation 6).
    Patience "patience" {
        /// Approach.
        approach_steps: u32 = 16 in 1..=1000, "steps";
        /// Grasp.
        grasp_steps: u32 = 12 in 1..=1000, "steps";
        /// Lift.
        lift_steps: u32 = 8 in 1..=1000, "steps";
        /// Transport.
        transport_steps: u32 = 16 in 1..=1000, "steps";
        /// Descend.
        descend_steps: u32 = 12 in 1..=1000, "steps";
        /// Release.
        release_steps: u32 = 8 in 1..=1000, "steps";
        /// Stabilise.
        stabilise_steps: u32 = 10 in 1..=1000, "steps";
    }
}

stage! {
    /// Time-out T of each phase: a phase that lasts longer has failed.
    Timeout "timeout" {
        /// Approach.
        approach_steps: u32 = 80 in 1..=10000, "steps";
        /// Grasp.
        grasp_steps: u32 = 30 in 1..=10000, "steps";
        /// Lift.
        lift_steps: u32 = 20 in 1..=10000, "steps";
        /// Transport.
        transport_steps: u32 = 60 in 1..=10000, "steps";
        /// Descend.
        descend_steps: u32 = 30 in 1..=10000, "steps";
        /// Release.
        release_steps: u32 = 12 in 1..=10000, "steps";
        /// Stabilise.
        stabilise_steps: u32 = 20 in 1..=10000, "steps";
    }
}

stage! {
    /// Evidence beyond stalls and time-outs.
    Evidence "evidence" {
        /// Another instance nearer than the lock by this much is approached.
        wrong_target_margin_m: f64 = 0.03 in 0.0..=0.5, "m";
        /// Another instance nearer than this is approached.
        wrong_target_distance_m: f64 = 0.08 in 0.01..=0.5, "m";
        /// Steps that a wrong-target approach must persist.
        wrong_target_steps: u32 = 8 in 1..=100, "steps";
        /// Growth of the target distance that is moving away.
        moving_away_m: f64 = 0.02 in 0.001..=0.5, "m";
        /// Steps over which it must grow.
        moving_away_steps: u32 = 8 in 1..=8, "steps";
        /// Fall of a lifted object with a closed gripper that is a drop.
        dropped_m: f64 = 0.03 in 0.005..=0.5, "m";
        /// Steps of lowering the object away from its destination, or of carrying it away, that are a wrong destination; 0 turns it off.
        wrong_destination_steps: u32 = 3 in 0..=100, "steps";
        /// Horizontal distance to the destination from which lowering is wrong.
        wrong_destination_xy_m: f64 = 0.08 in 0.01..=1.0, "m";
        /// Fall below the highest point of the carry that is lowering.
        wrong_destination_drop_m: f64 = 0.035 in 0.005..=0.5, "m";
        /// Growth of the horizontal distance to the destination over its least in the carry that is carrying away.
        wrong_destination_away_m: f64 = 0.06 in 0.005..=1.0, "m";
        /// Motion over four steps below which a released object is at rest (a 20 Hz step apart, 2 mm are 10 mm/s; the default leaves room for noisy poses).
        rest_distance_m: f64 = 0.008 in 0.0001..=0.1, "m";
        /// Steps at rest that settle the outcome of a release.
        rest_steps: u32 = 10 in 1..=200, "steps";
        /// Critic reports below this confidence are ignored.
        critic_confidence: f64 = 0.5 in 0.0..=1.0, "1";
    }
}

stage! {
    /// The lock on the target.
    Lock "lock" {
        /// tau_kappa: below it the binding is uncertain (equation 7; distinct from the gate's threshold, appendix A.5.2).
        kappa_min: f64 = 0.30 in 0.0..=1.0, "1";
        /// Least confidence in a binding, if it has any, while its target is lifted in the hand or being placed: policy and agents, who don't know of each other, mean the same thing. 0 turns it off.
        agreed: f64 = 0.35 in 0.0..=1.0, "1";
        /// A pose older than this gives no confidence. (The arm hides what stands behind it for a second or two, and what is at rest stays where it is.)
        pose_lost_ms: u32 = 2500 in 10..=10000, "ms";
        /// A jump of the locked pose without contact that is inconsistent.
        jump_m: f64 = 0.10 in 0.01..=1.0, "m";
        /// Weight of the height in the geometric score (lambda_z of equation 4).
        lambda_z: f64 = 0.5 in 0.0..=10.0, "1";
        /// Proposals of another target within one lock that count as a flapping detector.
        flaps: u32 = 5 in 1..=100, "records";
        /// How long the answer to a rebind request is awaited.
        rebind_wait_ms: u32 = 1000 in 0..=30000, "ms";
        /// Rebind requests in one subtask.
        rebinds: u32 = 2 in 0..=20, "requests";
    }
}

stage! {
    /// The adaptive intervention gate (appendix A.5 and C.2).
    Gate "gate" {
        /// Consecutive actionable failures of one type (A.5.1; tested there: 2, 3, 4).
        failure_streak: u32 = 3 in 1..=255, "queries";
        /// Least target confidence for an execution correction (A.5.2; tested there: 0.10, 0.12, 0.18).
        confidence: f64 = 0.12 in 0.0..=1.0, "1";
        /// Consecutive queries above that confidence.
        confidence_streak: u32 = 2 in 1..=255, "queries";
        /// Steps of an attempt before time-based evidence counts (A.5.3; tested there: 8, 12, 16).
        rescue_min_step: u32 = 12 in 0..=1000, "steps";
        /// Progress within this many steps keeps the gate closed without strong evidence (C.2); 0 turns the guard off.
        progress_guard_steps: u32 = 8 in 0..=1000, "steps";
        /// Steps after a hand-back before another correction.
        cool_down_steps: u32 = 16 in 0..=1000, "steps";
        /// Execution corrections in one subtask.
        activations: u32 = 4 in 0..=100, "activations";
        /// Least confidence of the plan's parse for any correction.
        plan_confidence: f64 = 0.5 in 0.0..=1.0, "1";
    }
}

stage! {
    /// How many actions a query may execute (equation 12).
    Horizon "horizon" {
        /// H_exec: while the gate is armed, after a rebind or after a hand-back (A.5.4; tested there: 1, 2, 3, 4).
        execution_steps: u32 = 2 in 1..=64, "steps";
        /// Steps after a hand-back during which H_exec holds.
        hand_back_steps: u32 = 8 in 0..=1000, "steps";
    }
}

stage! {
    /// Pick and place recovery (section 3.5 and appendix C.2).
    RecoveryParams "recovery" {
        /// Hover height above the target's top.
        hover_m: f64 = 0.10 in 0.01..=0.5, "m";
        /// Height of the underside above the destination while carrying.
        carry_m: f64 = 0.12 in 0.01..=0.5, "m";
        /// Part of the rise to the carry height that a long way may be begun with; 0 raises first and travels then, as in Table 19.
        rise_under_way_m: f64 = 0.07 in 0.0..=0.3, "m";
        /// Height of the fingertips above everything else on the way to the hover point.
        clearance_m: f64 = 0.05 in 0.0..=0.3, "m";
        /// Hover reached, horizontally.
        hover_xy_m: f64 = 0.015 in 0.001..=0.1, "m";
        /// Hover reached, vertically.
        hover_z_m: f64 = 0.030 in 0.001..=0.1, "m";
        /// Grasp point reached, horizontally.
        grasp_xy_m: f64 = 0.012 in 0.001..=0.1, "m";
        /// Grasp point reached, vertically.
        grasp_z_m: f64 = 0.015 in 0.001..=0.1, "m";
        /// Fewest queries of closing.
        close_min: u32 = 8 in 1..=100, "queries";
        /// Most queries of closing.
        close_max: u32 = 12 in 1..=100, "queries";
        /// Raise of the lift test.
        lift_test_m: f64 = 0.060 in 0.01..=0.3, "m";
        /// Rise of the object that passes the lift test.
        lift_pass_m: f64 = 0.030 in 0.005..=0.3, "m";
        /// Difference between the object's and the end effector's rise that still passes: a bowl that is held by its rim tilts, and the pads slide up its wall before they hold.
        lift_follow_m: f64 = 0.030 in 0.001..=0.3, "m";
        /// Queries for which the object must follow.
        lift_queries: u32 = 3 in 1..=100, "queries";
        /// Queries after which a lift test has failed.
        lift_timeout: u32 = 14 in 2..=200, "queries";
        /// Further descents after a failed one.
        redescents: u32 = 3 in 0..=20, "descents";
        /// Destination reached, horizontally, on a surface.
        align_on_m: f64 = 0.020 in 0.001..=0.2, "m";
        /// Destination reached, horizontally, in a container.
        align_in_m: f64 = 0.040 in 0.001..=0.2, "m";
        /// Height of the underside above a surface at release.
        release_on_m: f64 = 0.020 in 0.0..=0.2, "m";
        /// Depth of the underside below a container's rim at release.
        release_in_m: f64 = 0.020 in -0.1..=0.2, "m";
        /// Further queries of lowering onto a surface, until the underside touches it, before the gripper opens: what is let go above it swings and slides. 0 opens at `release_on_m`, as in Table 19.
        touch_queries: u32 = 5 in 0..=40, "queries";
        /// Queries of standing still while the gripper opens.
        release_hold: u32 = 4 in 1..=100, "queries";
        /// Rise of the end effector after release.
        retreat_m: f64 = 0.10 in 0.0..=0.5, "m";
        /// Queries of the post-release settling.
        settle: u32 = 6 in 0..=100, "queries";
        /// Queries of standing still after that until the outcome is known.
        verify: u32 = 14 in 0..=100, "queries";
        /// Upward command while settling.
        settle_up: f64 = 0.3 in 0.0..=1.0, "1";
        /// Query budget of a pick (Table 19 used 24; at 13 mm a step, which is what LIBERO's controller makes of a full command, a target 0.4 m away takes 60 to 80).
        pick_budget: u32 = 100 in 1..=10000, "queries";
        /// Query budget of a place (Table 19 used 31).
        place_budget: u32 = 100 in 1..=10000, "queries";
        /// Query budget of an episode.
        episode_budget: u32 = 260 in 1..=100000, "queries";
        /// Queries of standing still under command, near a joint limit, before the arm backs out.
        stuck_queries: u32 = 5 in 1..=100, "queries";
        /// Queries of backing out.
        back_out_queries: u32 = 6 in 1..=100, "queries";
        /// Distance to a joint limit that counts as being at it.
        joint_margin_rad: f64 = 0.05 in 0.0..=1.0, "rad";
        /// Tilt of the hand that is levelled before a descent; 0 never levels (equation 9 has no rotation).
        level_rad: f64 = 0.10 in 0.0..=1.6, "rad";
        /// Misalignment between fingers and a box that is turned away before a descent; 0 never turns.
        align_yaw_rad: f64 = 0.12 in 0.0..=1.6, "rad";
    }
}

stage! {
    /// Where to grasp, by object class.
    Grasp "grasp" {
        /// Objects taller than this are grasped below their top, others at their centre.
        tall_m: f64 = 0.09 in 0.01..=0.5, "m";
        /// Depth of the grasp below the top of a tall object.
        below_top_m: f64 = 0.020 in 0.0..=0.2, "m";
        /// Depth of the grasp below a bowl's rim.
        rim_depth_m: f64 = 0.015 in 0.0..=0.1, "m";
        /// Distance of the grasp inwards from a bowl's outer radius.
        rim_inset_m: f64 = 0.005 in 0.0..=0.05, "m";
        /// Lowest height of the tool centre point above the surface that the object stands on.
        floor_m: f64 = 0.010 in 0.0..=0.1, "m";
    }
}

stage! {
    /// Shaping of the setpoint: jerk-limited motion towards the action's goal.
    Shaping "shaping" {
        /// Speed, each axis.
        velocity_m_s: f64 = 1.0 in 0.01..=3.0, "m/s";
        /// Acceleration, each axis.
        acceleration_m_s2: f64 = 8.0 in 0.05..=13.0, "m/s^2";
        /// Jerk, each axis.
        jerk_m_s3: f64 = 400.0 in 1.0..=6500.0, "m/s^3";
        /// Angular speed.
        angular_velocity_rad_s: f64 = 2.0 in 0.01..=2.5, "rad/s";
        /// Angular acceleration.
        angular_acceleration_rad_s2: f64 = 20.0 in 0.05..=25.0, "rad/s^2";
        /// Angular jerk.
        angular_jerk_rad_s3: f64 = 1000.0 in 1.0..=12500.0, "rad/s^3";
    }
}

stage! {
    /// The last filter: limits that no command passes, whatever its reason
    /// (defaults: libfranka's Cartesian limits, `rate_limiting.h`).
    Filter "filter" {
        /// Speed, each axis.
        velocity_m_s: f64 = 1.7 in 0.01..=3.0, "m/s";
        /// Acceleration, each axis.
        acceleration_m_s2: f64 = 13.0 in 0.05..=13.0, "m/s^2";
        /// Jerk, each axis.
        jerk_m_s3: f64 = 6500.0 in 1.0..=6500.0, "m/s^3";
        /// Workspace, least x, base frame.
        workspace_min_x_m: f64 = -0.3 in -2.0..=2.0, "m";
        /// Workspace, least y, base frame.
        workspace_min_y_m: f64 = -0.8 in -2.0..=2.0, "m";
        /// Workspace, least z, base frame.
        workspace_min_z_m: f64 = -0.1 in -2.0..=2.0, "m";
        /// Workspace, greatest x, base frame.
        workspace_max_x_m: f64 = 0.9 in -2.0..=2.0, "m";
        /// Workspace, greatest y, base frame.
        workspace_max_y_m: f64 = 0.8 in -2.0..=2.0, "m";
        /// Workspace, greatest z, base frame.
        workspace_max_z_m: f64 = 1.2 in -2.0..=2.0, "m";
    }
}
