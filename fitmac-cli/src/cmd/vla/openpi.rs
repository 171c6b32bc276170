//! `fitmac vla --openpi`: a policy behind an openpi server, on shared memory.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, bail};
use fitmac_core::{
    message::PolicyQuery,
    wire::{ActionFrame, ActionSpace, GripperConvention},
};
use fitmac_openpi::{
    Address, Client, Conventions, Failure, Observation, Settings, client::ApiKey, libero_state,
    metadata::Expectation,
};
use fitmac_rt::{
    clock, endpoint::PolicyEndpoint, instance::Instance, port::Session, signals::Signals,
    transport::Ipc,
};

use super::{LOOK, View, mirror::Mirror};
use crate::{
    card::Card,
    crew::Report,
    exit::{BadInput, Exit},
};

/// The environment variable of the server's key.
const KEY_VARIABLE: &str = "FITMAC_OPENPI_KEY";
/// How often a connection without a question is looked after, ns.
const TEND_NS: u64 = 100_000_000;

/// Where LIBERO's worlds have the robot's base, m: positions of openpi's states are in the world.
const TABLE_BASE_M: [f64; 3] = [-0.66, 0.0, 0.912];
const FLOOR_BASE_M: [f64; 3] = [-0.6, 0.0, 0.0];

/// How pictures are turned before they are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Pictures {
    /// Left and right exchanged, as in LIBERO's training data.
    Libero,
    /// As a camera sees it.
    Upright,
}

/// Arguments of a policy behind an openpi server.
#[derive(Clone, Debug, clap::Args)]
#[group(id = "openpi")]
#[command(next_help_heading = "Policy behind an openpi server")]
pub(super) struct Args {
    /// Ask the policy of this server, ws://HOST:PORT, instead of a surrogate. Its key, if it wants
    /// one, is read from FITMAC_OPENPI_KEY.
    #[arg(long = "openpi", value_name = "URL", requires = "horizon")]
    address: Option<Address>,
    /// Actions in an answer; others are refused (pi0: 50, pi0-FAST and pi0.5: 10).
    #[arg(long = "openpi-horizon", value_name = "N", requires = "address")]
    horizon: Option<usize>,
    /// What an action is.
    #[arg(long = "openpi-action-space", value_name = "NAME", requires = "address",
          default_value = "osc_pose_delta", value_parser = action_space)]
    action_space: ActionSpace,
    /// What the gripper's number means: minus_one_open (LIBERO) or one_open.
    #[arg(long = "openpi-gripper", value_name = "NAME", requires = "address",
          default_value = "minus_one_open", value_parser = gripper)]
    gripper: GripperConvention,
    /// What the server's metadata must say; may be given several times.
    #[arg(long = "openpi-expect", value_name = "KEY=VALUE", requires = "address",
          value_parser = expectation)]
    expected: Vec<Expectation>,
    /// How pictures are turned.
    #[arg(
        long = "openpi-pictures",
        value_enum,
        requires = "address",
        default_value = "libero"
    )]
    pictures: Pictures,
    /// The robot's base in the world of the policy's training, m [default: LIBERO's, of --suite].
    #[arg(long = "openpi-base", value_name = "X,Y,Z", requires = "address",
          value_parser = place, allow_hyphen_values = true)]
    base_m: Option<[f64; 3]>,
    /// Longest wait for an answer, ms; the first of a connection has two minutes.
    #[arg(long = "openpi-timeout-ms", value_name = "MS", requires = "address",
          default_value_t = 5000, value_parser = clap::value_parser!(u64).range(1..=600_000))]
    timeout_ms: u64,
}

fn by_name<T: Copy>(
    members: &[T],
    name_of: fn(T) -> &'static str,
    name: &str,
) -> Result<T, String> {
    let found = members.iter().find(|member| name_of(**member) == name);
    found.copied().ok_or_else(|| {
        let names: Vec<_> = members.iter().map(|member| name_of(*member)).collect();
        format!("there are: {}", names.join(", "))
    })
}

fn action_space(name: &str) -> Result<ActionSpace, String> {
    by_name(ActionSpace::ALL, ActionSpace::name, name)
}

fn gripper(name: &str) -> Result<GripperConvention, String> {
    by_name(GripperConvention::ALL, GripperConvention::name, name)
}

fn expectation(text: &str) -> Result<Expectation, String> {
    let (key, value) = text.split_once('=').ok_or("give KEY=VALUE")?;
    Ok(Expectation {
        key: key.to_owned(),
        value: value.to_owned(),
    })
}

fn place(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok().filter(|x: &f64| x.abs() <= 100.0))
        .collect();
    let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
    numbers.ok_or_else(|| "give three numbers in metres, such as -0.66,0,0.912".to_owned())
}

impl Args {
    /// The server that is asked for, if one is.
    fn settings(&self) -> anyhow::Result<Option<Settings>> {
        let (Some(address), Some(horizon)) = (&self.address, self.horizon) else {
            return Ok(None);
        };
        let conventions = Conventions {
            action_space: self.action_space,
            frame: ActionFrame::Base,
            gripper: self.gripper,
            horizon,
        };
        let mut settings = Settings::new(address.clone(), conventions);
        settings.expected.clone_from(&self.expected);
        settings.answer_timeout_ms = self.timeout_ms;
        if let Ok(key) = std::env::var(KEY_VARIABLE) {
            let key = ApiKey::new(&key);
            settings.api_key =
                Some(key.map_err(|error| BadInput(format!("{KEY_VARIABLE}: {error}")))?);
        }
        Ok(Some(settings))
    }
}

/// A policy behind a server, and what it is shown.
pub(super) struct Remote {
    client: Client,
    pictures: Pictures,
    base_m: [f64; 3],
    told: Option<String>,
    tended_ns: u64,
}

impl Remote {
    /// The one that the arguments ask for, if they do.
    pub(super) fn of(args: &Args, suite: &str) -> anyhow::Result<Option<Self>> {
        let Some(settings) = args.settings()? else {
            return Ok(None);
        };
        let client = Client::new(settings, clock::now_ns);
        let client = client.map_err(|error| BadInput(format!("--openpi-horizon: {error}")))?;
        let base_m = args.base_m.unwrap_or(match suite {
            "object" => FLOOR_BASE_M,
            _ => TABLE_BASE_M,
        });
        Ok(Some(Self {
            client,
            pictures: args.pictures,
            base_m,
            told: None,
            tended_ns: 0,
        }))
    }

    /// Answers queries until it is asked to end.
    pub(super) fn run(
        mut self,
        card: Card,
        instance: &str,
        signals: &Signals,
    ) -> anyhow::Result<Exit> {
        let mut mirror = Mirror::of(&card).context("the scene of the card cannot be shown")?;
        let instance = Instance::named(instance)?;
        let transport = Ipc::join(&instance)?;
        let mut endpoint = PolicyEndpoint::connect(&transport, Session::start())?;
        let mut view = View {
            card,
            prompts: BTreeMap::new(),
            state: None,
        };
        eprintln!(
            "openpi: pictures are cast by rays from the scene card and the robot's samples; there \
             is no camera"
        );
        Report::Ready.send();
        while !signals.stop_requested() {
            view.refresh(&mut endpoint);
            let Some(query) = endpoint.poll_query() else {
                self.tend(signals)?;
                std::thread::sleep(LOOK);
                continue;
            };
            view.refresh(&mut endpoint);
            self.answer(&query, &view, &mut mirror, &mut endpoint, signals)?;
        }
        self.sum_up();
        Ok(Exit::Done)
    }

    /// Looks after the connection between queries.
    fn tend(&mut self, signals: &Signals) -> anyhow::Result<()> {
        let now_ns = clock::now_ns();
        if now_ns.saturating_sub(self.tended_ns) < TEND_NS {
            return Ok(());
        }
        let result = self.client.tend(&|| !signals.stop_requested());
        self.tended_ns = clock::now_ns();
        self.note(result.err())
    }

    /// Asks the server, and publishes its answer if it is sound.
    fn answer(
        &mut self,
        query: &PolicyQuery,
        view: &View,
        mirror: &mut Mirror,
        endpoint: &mut PolicyEndpoint<Ipc>,
        signals: &Signals,
    ) -> anyhow::Result<()> {
        let Some(state) = &view.state else {
            return Ok(()); // the controller asks again
        };
        let pictures = mirror.pictures(state).context("pictures of the scene")?;
        let [image, wrist_image] = match self.pictures {
            Pictures::Upright => pictures,
            Pictures::Libero => pictures.map(|picture| picture.mirrored()),
        };
        let observation = Observation {
            image: &image,
            wrist_image: &wrist_image,
            state: libero_state(
                state.ee_position_m,
                state.ee_orientation,
                state.gripper_width_m,
                self.base_m,
            ),
            prompt: view.prompt(query),
        };
        match self
            .client
            .infer(&observation, &|| !signals.stop_requested())
        {
            Ok(answer) => {
                self.note(None)?;
                let conventions = &self.client.settings().conventions;
                let mut chunk = answer.chunk(conventions, state.stamp_ns);
                endpoint.send_chunk(clock::now_ns(), query, &mut chunk)?;
                Ok(())
            }
            Err(failure) => self.note(Some(failure)),
        }
    }

    /// Tells what is new, and gives up where trying again cannot help.
    fn note(&mut self, failure: Option<Failure>) -> anyhow::Result<()> {
        let news = match failure {
            Some(Failure::Waiting | Failure::Stopped) => return Ok(()),
            Some(Failure::WrongServer(mismatch)) if self.client.counters().connections == 0 => {
                bail!(BadInput(mismatch.to_string()))
            }
            Some(failure) => failure.to_string(),
            None => match self.client.metadata() {
                Some(metadata) => {
                    let keys: BTreeSet<_> = metadata.keys().take(16).collect();
                    format!("connected; the server's metadata has {keys:?}")
                }
                None => return Ok(()),
            },
        };
        if self.told.as_ref() != Some(&news) {
            eprintln!("openpi: {news}");
            self.told = Some(news);
        }
        Ok(())
    }

    fn sum_up(&self) {
        let counters = self.client.counters();
        let failures: Vec<_> = counters
            .failures
            .iter()
            .map(|(name, count)| format!(", {name} {count}"))
            .collect();
        eprintln!(
            "openpi: connections {}, answers {}{}",
            counters.connections,
            counters.answers,
            failures.concat()
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn declarations_are_read_by_their_names() {
        assert_eq!(gripper("one_open"), Ok(GripperConvention::OneOpen));
        assert!(
            gripper("open")
                .unwrap_err()
                .contains("minus_one_open, one_open")
        );
        assert_eq!(
            action_space("osc_pose_delta"),
            Ok(ActionSpace::OscPoseDelta)
        );
        assert!(
            action_space("joints")
                .unwrap_err()
                .contains("osc_pose_delta")
        );
        assert_eq!(place("-0.66, 0, 0.912"), Ok(TABLE_BASE_M));
        for text in ["", "1,2", "1,2,3,4", "1,2,nan", "1,2,x", "0,0,912"] {
            assert!(place(text).is_err(), "{text}");
        }
        let read = expectation("model=a=b").unwrap();
        assert_eq!((read.key.as_str(), read.value.as_str()), ("model", "a=b"));
        assert!(expectation("model").is_err());
    }
}
