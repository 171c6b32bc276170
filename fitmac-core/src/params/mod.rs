//! Parameters: declared with range, unit, default and reason; checked once;
//! immutable afterwards.

mod assign;
mod stage;
mod stages;

pub use assign::AssignError;
pub use stage::{ParamInfo, Violation, Violations};
pub use stages::{
    ActionScale, ChunkIntake, Clock, Evidence, Filter, Gate, Grasp, Gripper, Horizon, Lock,
    Patience, PhaseParams, Progress, RecoveryParams, Shaping, StateIntake, Timeout, Tracking,
};

use crate::wire::GripperConvention;

/// Which corrections may act (the paper's ablations, Table 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Switches {
    /// Rebinding of the target.
    pub target_corrector: bool,
    /// Execution correction as a whole.
    pub execution_corrector: bool,
    /// The pick recovery.
    pub hard_pick: bool,
    /// The place recovery.
    pub hard_place: bool,
}

impl Switches {
    /// Everything on.
    pub const FULL: Self = Self {
        target_corrector: true,
        execution_corrector: true,
        hard_pick: true,
        hard_place: true,
    };
    /// Everything off: the base policy alone, watched.
    pub const BACKBONE_ONLY: Self = Self {
        target_corrector: false,
        execution_corrector: false,
        hard_pick: false,
        hard_place: false,
    };

    /// True if no correction can ever act.
    #[must_use]
    pub const fn none(self) -> bool {
        !self.target_corrector && !(self.execution_corrector && (self.hard_pick || self.hard_place))
    }
}

impl Default for Switches {
    fn default() -> Self {
        Self::FULL
    }
}

/// What to do with an action outside [-1, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum OutOfRange {
    /// Clamp it and flag the command (what LIBERO's environment does silently).
    #[default]
    Clamp,
    /// Refuse the whole chunk.
    Refuse,
}

/// Who acts while the target is looked at again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum WhileRebinding {
    /// Stand still, at most for `lock.rebind_wait_ms`.
    #[default]
    Hold,
    /// The base policy goes on.
    BaseActs,
}

/// The gripper convention that the policy must declare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum PolicyGripper {
    /// -1 opens, +1 closes.
    #[default]
    MinusOneOpen,
    /// 1 opens, 0 closes; converted by a threshold at one half.
    OneOpen,
}

impl PolicyGripper {
    /// The same as the chunk's header names it.
    #[must_use]
    pub const fn convention(self) -> GripperConvention {
        match self {
            Self::MinusOneOpen => GripperConvention::MinusOneOpen,
            Self::OneOpen => GripperConvention::OneOpen,
        }
    }
}

macro_rules! params {
    ($($(#[$doc:meta])* $field:ident: $type:ident,)+) => {
        /// Every parameter of the core, nested by stage.
        ///
        /// `Params::default()` is the `guarded` profile: do no harm.
        #[derive(Clone, Copy, Debug, PartialEq, Default)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
        pub struct Params {
            /// Which corrections may act.
            pub switches: Switches,
            /// What to do with an action outside [-1, 1].
            pub out_of_range: OutOfRange,
            /// Who acts while the target is looked at again.
            pub while_rebinding: WhileRebinding,
            /// The gripper convention that the policy must declare.
            pub policy_gripper: PolicyGripper,
            $($(#[$doc])* pub $field: $type,)+
        }

        impl Params {
            /// The tables of all stages, for reference documentation.
            pub const TABLES: &[&[ParamInfo]] = &[$($type::TABLE,)+];

            fn assign_stage(
                &mut self,
                stage: &str,
                name: &str,
                text: &str,
            ) -> Result<(), AssignError> {
                match stage {
                    $(stringify!($field) => self.$field.assign(name, text),)+
                    _ => Err(AssignError::UnknownKey),
                }
            }

            fn check_stages(&self, found: &mut Violations) {
                $(self.$field.check(found);)+
            }
        }
    };
}

params! {
    /// Clocks.
    clock: Clock,
    /// State intake.
    state: StateIntake,
    /// Chunk intake.
    chunk: ChunkIntake,
    /// Action space.
    action: ActionScale,
    /// Gripper.
    gripper: Gripper,
    /// Steadying of object poses.
    tracking: Tracking,
    /// Phase estimation.
    phase: PhaseParams,
    /// Progress.
    progress: Progress,
    /// Patience of each phase.
    patience: Patience,
    /// Time-out of each phase.
    timeout: Timeout,
    /// Evidence.
    evidence: Evidence,
    /// Lock.
    lock: Lock,
    /// Gate.
    gate: Gate,
    /// Horizon.
    horizon: Horizon,
    /// Recovery.
    recovery: RecoveryParams,
    /// Grasp.
    grasp: Grasp,
    /// Shaping.
    shaping: Shaping,
    /// The last filter.
    filter: Filter,
}

/// Parameters that were checked: the only kind that a controller takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValidParams(Params);

impl ValidParams {
    /// The parameters.
    #[must_use]
    pub const fn get(&self) -> &Params {
        &self.0
    }
}

impl Params {
    /// The `guarded` profile, the default: intervenes on firm evidence only.
    #[must_use]
    pub fn guarded() -> Self {
        Self::default()
    }

    /// The `paper` profile: as published, where the paper says it; no monitor
    /// or motion that it doesn't have.
    #[must_use]
    pub fn paper() -> Self {
        let mut params = Self {
            while_rebinding: WhileRebinding::BaseActs,
            ..Self::default()
        };
        params.progress.reversals = 0;
        params.evidence.wrong_destination_steps = 0;
        params.recovery.level_rad = 0.0;
        params.recovery.align_yaw_rad = 0.0;
        params.gate.plan_confidence = 0.0;
        params.tracking.gain = 1.0;
        params.recovery.rise_under_way_m = 0.0;
        params.recovery.touch_queries = 0;
        params.lock.agreed = 0.0;
        params
    }

    /// Checks every parameter and the relations between them.
    ///
    /// # Errors
    /// Every violation at once, each with the field's name and range.
    #[expect(
        clippy::result_large_err,
        reason = "without an allocator the list of violations has a fixed size"
    )]
    pub fn validate(self) -> Result<ValidParams, Violations> {
        let mut found = Violations::none();
        self.check_stages(&mut found);
        self.check_relations(&mut found);
        if found.is_empty() {
            Ok(ValidParams(self))
        } else {
            Err(found)
        }
    }

    fn check_relations(&self, found: &mut Violations) {
        let (s, c, r, f) = (&self.state, &self.chunk, &self.recovery, &self.filter);
        found.require(
            s.hold_age_ms < s.stop_age_ms,
            "state",
            "hold_age_ms must be below stop_age_ms",
            s.hold_age_ms.into(),
        );
        found.require(
            c.hold_after_ms < c.stop_after_ms,
            "chunk",
            "hold_after_ms must be below stop_after_ms",
            c.hold_after_ms.into(),
        );
        found.require(
            c.refusals_hold < c.refusals_stop,
            "chunk",
            "refusals_hold must be below refusals_stop",
            c.refusals_hold.into(),
        );
        found.require(
            c.query_lead_steps < c.open_loop_steps,
            "chunk",
            "query_lead_steps must be below open_loop_steps",
            c.query_lead_steps.into(),
        );
        found.require(
            r.close_min <= r.close_max,
            "recovery",
            "close_min must not exceed close_max",
            r.close_min.into(),
        );
        found.require(
            r.lift_pass_m < r.lift_test_m,
            "recovery",
            "lift_pass_m must be below lift_test_m",
            r.lift_pass_m,
        );
        found.require(
            r.lift_queries < r.lift_timeout,
            "recovery",
            "lift_queries must be below lift_timeout",
            r.lift_queries.into(),
        );
        found.require(
            r.grasp_xy_m <= r.hover_xy_m,
            "recovery",
            "grasp_xy_m must not exceed hover_xy_m",
            r.grasp_xy_m,
        );
        found.require(
            r.release_on_m < r.carry_m,
            "recovery",
            "release_on_m must be below carry_m",
            r.release_on_m,
        );
        found.require(
            self.phase.grasp_xy_m <= self.phase.approach_distance_m,
            "phase",
            "grasp_xy_m must not exceed approach_distance_m",
            self.phase.grasp_xy_m,
        );
        found.require(
            self.gripper.empty_width_m < self.gripper.open_width_m * self.gripper.closed_ratio,
            "gripper",
            "empty_width_m must be below the closed width",
            self.gripper.empty_width_m,
        );
        found.require(
            self.shaping.velocity_m_s <= f.velocity_m_s,
            "shaping",
            "velocity_m_s must not exceed filter.velocity_m_s",
            self.shaping.velocity_m_s,
        );
        found.require(
            self.shaping.acceleration_m_s2 <= f.acceleration_m_s2,
            "shaping",
            "acceleration_m_s2 must not exceed filter.acceleration_m_s2",
            self.shaping.acceleration_m_s2,
        );
        found.require(
            self.shaping.jerk_m_s3 <= f.jerk_m_s3,
            "shaping",
            "jerk_m_s3 must not exceed filter.jerk_m_s3",
            self.shaping.jerk_m_s3,
        );
        found.require(
            f.workspace_min_x_m < f.workspace_max_x_m,
            "filter",
            "workspace_min_x_m must be below workspace_max_x_m",
            f.workspace_min_x_m,
        );
        found.require(
            f.workspace_min_y_m < f.workspace_max_y_m,
            "filter",
            "workspace_min_y_m must be below workspace_max_y_m",
            f.workspace_min_y_m,
        );
        found.require(
            f.workspace_min_z_m < f.workspace_max_z_m,
            "filter",
            "workspace_min_z_m must be below workspace_max_z_m",
            f.workspace_min_z_m,
        );
    }
}
