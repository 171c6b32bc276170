//! `fitmac ground`: the object that an instruction means.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use fitmac_agents::canvas::Canvas;
use fitmac_agents::grounder::{self, Destination, Grounding, Viewpoint, resolver};
use fitmac_agents::model::{Cancel, ChatModel, Question};
use fitmac_agents::scene::Scene;

use super::plan::ModelArgs;
use crate::exit::{BadInput, Exit};

/// Largest scene file that is read, bytes.
const SCENE_CAP_BYTES: u64 = 1 << 20;

/// Arguments of `ground`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  fitmac ground --scene scene.json \"pick up the bowl on the stove and place it on the plate\"
  fitmac ground --scene scene.json --json --viewpoint robot \"put the left mug on the plate\"
  fitmac ground --scene scene.json --image camera.png --annotated marked.png \"take the mug\"

A scene is a JSON object:
  {\"objects\": [{\"label\": \"black_bowl\", \"confidence\": 0.9,
                \"position_m\": [0.5, 0.1, 0.03], \"size_m\": [0.11, 0.11, 0.05]}],
   \"fixtures\": [], \"table\": {\"centre_m\": [0.5, 0, 0], \"half_extent_m\": [0.4, 0.5]}}
Positions are centres in the robot's base frame, in metres. An object is drawn into the image
where its box_px says, as [x, y, width, height]; without one, where the scene's camera sees it.
A model is asked only where the rules leave the choice open; it sees the marked image.
Exit status: 1 if no object is plainly meant.")]
pub(crate) struct Args {
    /// The instruction.
    instruction: String,
    /// File with the scene.
    #[arg(long)]
    scene: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Step of the plan to ground, from 1.
    #[arg(long, default_value_t = 1)]
    step: usize,
    /// Whose left is left: the camera's (the robot's without a camera) or the
    /// robot's.
    #[arg(long, value_enum, default_value_t)]
    viewpoint: View,
    /// The camera's image as PNG, for the model: candidates are framed in red with
    /// their number, references in green, the rest in blue.
    #[arg(long, value_name = "PNG")]
    image: Option<PathBuf>,
    /// Write the marked image here.
    #[arg(long, value_name = "PNG", requires = "image")]
    annotated: Option<PathBuf>,
    #[command(flatten)]
    model: ModelArgs,
}

/// The viewer of left and right.
#[derive(Clone, Copy, Default, clap::ValueEnum)]
enum View {
    /// The scene's camera.
    #[default]
    Camera,
    /// The robot.
    Robot,
}

/// Grounds and prints.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let scene = read_scene(&args.scene)?;
    let image = args.image.as_deref().map(read_image).transpose()?;
    let model = args.model.chat()?;
    let plan = super::plan::plan(&args.instruction, model.as_ref())?;
    let index = args.step.wrapping_sub(1);
    let step = plan.subtasks.get(index).ok_or_else(|| {
        BadInput(format!(
            "--step {}: the plan has {} steps",
            args.step,
            plan.subtasks.len()
        ))
    })?;
    let viewpoint = match args.viewpoint {
        View::Camera => Viewpoint::Camera,
        View::Robot => Viewpoint::Robot,
    };
    let context = grounder::Context {
        viewpoint,
        excluded: &[],
    };
    let mut grounding = grounder::ground(step, &scene, &context);
    if let (Some(image), Some(path)) = (&image, &args.annotated) {
        write_annotated(path, image, &grounding)?;
    }
    if let Some(model) = model.filter(|_| grounding.verdict.needs_resolver()) {
        let question =
            resolver::question(&plan, index, &args.instruction, &grounding, image.as_ref());
        resolve(&mut grounding, &question, &model);
    }
    if args.json {
        println!("{}", serde_json::to_string_pretty(&grounding)?);
    } else {
        print(&grounding);
    }
    let plain = grounding.verdict == grounder::Verdict::Resolved;
    Ok(if plain { Exit::Done } else { Exit::Negative })
}

fn resolve(grounding: &mut Grounding, question: &Question, model: &ChatModel) {
    let png = question.png.as_deref();
    let (answer, _) = model.ask(question.system, &question.user, png, &Cancel::default());
    let count = grounding.candidates.len();
    match answer.and_then(|answer| resolver::ResolverOutput::parse(&answer, count)) {
        Ok(choice) => {
            if !grounding.apply(&choice) {
                eprintln!("fitmac: the model's choice is plainly worse; the rules' answer stands");
            }
        }
        Err(error) => {
            eprintln!("fitmac: the model didn't help: {error}; the rules' answer stands");
        }
    }
}

/// Largest image file that is read, bytes.
const IMAGE_CAP_BYTES: u64 = 32 << 20;

fn read_image(path: &Path) -> anyhow::Result<Canvas> {
    let name = path.display();
    let file = std::fs::File::open(path)
        .with_context(|| BadInput(format!("--image {name}: can't be opened")))?;
    let mut bytes = Vec::new();
    file.take(IMAGE_CAP_BYTES)
        .read_to_end(&mut bytes)
        .with_context(|| BadInput(format!("--image {name}: can't be read")))?;
    let image = Canvas::from_png(&bytes);
    Ok(image.map_err(|error| BadInput(format!("--image {name}: {error}")))?)
}

fn write_annotated(path: &Path, image: &Canvas, grounding: &Grounding) -> anyhow::Result<()> {
    let png = resolver::annotate(image, grounding).png()?;
    std::fs::write(path, png)
        .with_context(|| BadInput(format!("--annotated {}: can't be written", path.display())))
}

fn read_scene(path: &Path) -> anyhow::Result<Scene> {
    let file = std::fs::File::open(path)
        .with_context(|| BadInput(format!("--scene {}: can't be opened", path.display())))?;
    let mut text = String::new();
    file.take(SCENE_CAP_BYTES)
        .read_to_string(&mut text)
        .with_context(|| BadInput(format!("--scene {}: can't be read as text", path.display())))?;
    let scene = Scene::from_json(&text);
    Ok(scene.map_err(|error| BadInput(format!("--scene {}: {error}", path.display())))?)
}

fn print(grounding: &Grounding) {
    println!("{:?}: {}", grounding.verdict, grounding.reason);
    for (index, candidate) in grounding.candidates.iter().enumerate() {
        let mark = if grounding.selected_index == Some(index) {
            '*'
        } else {
            ' '
        };
        println!(
            "{mark} {index}  {:<24} name {:.2}  relation {:.2}",
            candidate.seen.label, candidate.name_score, candidate.relation_score
        );
    }
    println!("confidence {:.2}", grounding.confidence);
    match &grounding.destination {
        Destination::None => {}
        Destination::Direct(anchor) => {
            println!("destination: {:?} {}", anchor.relation, anchor.label)
        }
        Destination::Relational { reason } => {
            println!("destination: left to the policy, {reason}");
        }
    }
}
