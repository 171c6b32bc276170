//! The robot's own watchdog: our death must be safe.

use fitmac_core::message::Command;

use crate::envelope::Envelope;

/// A setpoint that is this slow stands, for all practical purposes.
const STANDING_M_S: f64 = 1e-3;

/// When a robot stops following.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommandLimits {
    /// A command older than this is not followed, ns. 20 ms is 20 lost ticks
    /// at 1 kHz: where Franka's control interface gives up too.
    pub age_max_ns: u64,
}

impl Default for CommandLimits {
    fn default() -> Self {
        Self {
            age_max_ns: 20_000_000,
        }
    }
}

/// Why a robot does not follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopCause {
    /// No command came yet.
    NeverStarted,
    /// Commands ceased without a last one: the controller died or hangs.
    Silence,
    /// The controller said goodbye.
    Ended,
    /// Another controller sends while the one that was followed is not silent yet.
    Intruder,
    /// The command's numbers are not finite, or its codes unknown.
    Unsound,
}

/// What a robot shall do now.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // a box would allocate
pub enum CommandState {
    /// Follow this command.
    Follow(Command),
    /// Come to a stop within the robot's own limits, and stand.
    Stop(StopCause),
}

/// Judges commands by session, sequence, age and soundness on the robot's side.
#[derive(Clone, Debug, PartialEq)]
pub struct CommandWatch {
    limits: CommandLimits,
    standing: Standing,
}

#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // a box would allocate
enum Standing {
    Waiting {
        cause: StopCause,
        /// Commands of this session are over: its stragglers count for nothing.
        past_session: u64,
    },
    Following {
        session: u64,
        received_ns: u64,
        command: Command,
    },
}

impl CommandWatch {
    /// A watch that has seen no command.
    #[must_use]
    pub fn new(limits: CommandLimits) -> Self {
        Self {
            limits,
            standing: Standing::Waiting {
                cause: StopCause::NeverStarted,
                past_session: 0,
            },
        }
    }

    /// Takes what arrived since the last call, at `now_ns`, and says what to do.
    pub fn step(&mut self, now_ns: u64, arrived: Option<&Envelope<Command>>) -> CommandState {
        if let Some(envelope) = arrived {
            self.take(now_ns, envelope);
        }
        if let Standing::Following {
            session,
            received_ns,
            ..
        } = self.standing
            && now_ns.saturating_sub(received_ns) > self.limits.age_max_ns
        {
            self.wait(StopCause::Silence, session);
        }
        match &self.standing {
            Standing::Waiting { cause, .. } => CommandState::Stop(*cause),
            Standing::Following { command, .. } => CommandState::Follow(*command),
        }
    }

    fn take(&mut self, now_ns: u64, envelope: &Envelope<Command>) {
        let (session, command) = (envelope.header.session, &envelope.payload);
        let age = now_ns.saturating_sub(envelope.header.stamp_ns);
        match self.standing {
            // After a pause the same controller is followed again from a
            // standstill only: never into the middle of a motion.
            Standing::Waiting {
                cause: StopCause::Silence,
                past_session,
            } if session == past_session && stands(command) => {}
            // Sessions only rise: a straggler of a dead controller, or one
            // that was stopped and wakes up again, is not followed.
            Standing::Waiting { past_session, .. } if session <= past_session => return,
            Standing::Following {
                session: current, ..
            } if session < current => return,
            Standing::Following {
                session: current, ..
            } if session > current => return self.wait(StopCause::Intruder, current),
            _ => {}
        }
        if age > self.limits.age_max_ns {
            return;
        }
        if !is_sound(command) {
            return self.wait(StopCause::Unsound, session);
        }
        if command.flags & Command::LAST != 0 {
            return self.wait(StopCause::Ended, session);
        }
        self.standing = Standing::Following {
            session,
            received_ns: now_ns,
            command: *command,
        };
    }

    fn wait(&mut self, cause: StopCause, past_session: u64) {
        self.standing = Standing::Waiting {
            cause,
            past_session,
        };
    }
}

/// Whether the command asks for no motion at all.
fn stands(command: &Command) -> bool {
    command.action[..6].iter().all(|a| *a == 0.0)
        && command
            .setpoint_velocity_m_s
            .iter()
            .all(|v| v.abs() < STANDING_M_S)
}

fn is_sound(command: &Command) -> bool {
    let numbers = [
        &command.action[..],
        &command.setpoint_position_m,
        &command.setpoint_velocity_m_s,
        &command.setpoint_acceleration_m_s2,
        &command.setpoint_orientation,
    ];
    numbers.iter().all(|n| n.iter().all(|x| x.is_finite()))
        && command.action.iter().all(|x| x.abs() <= 1.0)
        && command.mode().is_some()
        && command.route().is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::Payload;

    const MS: u64 = 1_000_000;

    fn command(session: u64, at_ms: u64) -> Envelope<Command> {
        Envelope::new(session, at_ms, at_ms * MS, Command::zeroed())
    }

    fn watch() -> CommandWatch {
        CommandWatch::new(CommandLimits::default())
    }

    #[test]
    fn a_robot_stands_until_a_command_comes_and_stops_when_they_cease() {
        let mut w = watch();
        assert_eq!(w.step(0, None), CommandState::Stop(StopCause::NeverStarted));
        let c = command(5, 1);
        assert_eq!(w.step(MS, Some(&c)), CommandState::Follow(c.payload));
        assert_eq!(w.step(21 * MS, None), CommandState::Follow(c.payload));
        assert_eq!(
            w.step(21 * MS + 1, None),
            CommandState::Stop(StopCause::Silence)
        );
        // The same session comes back from a standstill only.
        let mut moving = command(5, 22);
        moving.payload.action[0] = 0.2;
        assert_eq!(
            w.step(22 * MS, Some(&moving)),
            CommandState::Stop(StopCause::Silence)
        );
        let mut coasting = command(5, 22);
        coasting.payload.setpoint_velocity_m_s[1] = -0.1;
        assert_eq!(
            w.step(22 * MS, Some(&coasting)),
            CommandState::Stop(StopCause::Silence)
        );
        let standing = command(5, 23);
        assert_eq!(
            w.step(23 * MS, Some(&standing)),
            CommandState::Follow(standing.payload)
        );
        // A new session is followed after a silence, wherever it begins.
        w.step(60 * MS, None);
        let mut restarted = command(6, 61);
        restarted.payload.action[0] = 0.2;
        assert_eq!(
            w.step(61 * MS, Some(&restarted)),
            CommandState::Follow(restarted.payload)
        );
    }

    #[test]
    fn a_last_command_ends_the_session_at_once() {
        let mut w = watch();
        w.step(MS, Some(&command(5, 1)));
        let mut last = command(5, 2);
        last.payload.flags = Command::LAST;
        for arrived in [last, command(5, 3)] {
            assert_eq!(
                w.step(2 * MS, Some(&arrived)),
                CommandState::Stop(StopCause::Ended)
            );
        }
    }

    #[test]
    fn two_controllers_stop_the_robot() {
        let mut w = watch();
        w.step(MS, Some(&command(5, 1)));
        assert_eq!(
            w.step(2 * MS, Some(&command(6, 2))),
            CommandState::Stop(StopCause::Intruder)
        );
    }

    #[test]
    fn old_and_unsound_commands_are_not_followed() {
        let mut w = watch();
        assert_eq!(
            w.step(100 * MS, Some(&command(5, 1))),
            CommandState::Stop(StopCause::NeverStarted)
        );
        for spoil in [
            |c: &mut Command| c.action[3] = f64::NAN,
            |c: &mut Command| c.action[0] = 1.5,
            |c: &mut Command| c.setpoint_position_m[1] = f64::INFINITY,
            |c: &mut Command| c.mode = 99,
        ] {
            let mut w = watch();
            let mut bad = command(5, 1);
            spoil(&mut bad.payload);
            assert_eq!(
                w.step(MS, Some(&bad)),
                CommandState::Stop(StopCause::Unsound)
            );
        }
    }
}
