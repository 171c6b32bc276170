//! `fitmac plan`: an instruction as subtasks.

use fitmac_agents::model::{Cancel, ChatModel, ModelConfig, prompts};
use fitmac_agents::planner::{self, PlannerOutput, SURE, TaskPlan};

use crate::exit::{BadInput, Exit};

/// Arguments of `plan`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  fitmac plan \"pick up the bowl next to the ramekin and place it on the plate\"
  fitmac plan --json \"put both the soup and the milk in the basket\"
  fitmac plan --model-url http://127.0.0.1:11434/v1 --model qwen3 \"tidy the mug into the bin\"

With --json: one object with the nine keys of the planner's schema. With several
steps, `plan` lists them and the other keys describe the first.
A model is asked only where the rules are unsure.
Exit status: 1 if the instruction wasn't understood.")]
pub(crate) struct Args {
    /// The instruction.
    instruction: String,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    model: ModelArgs,
}

/// A model to ask.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ModelArgs {
    /// OpenAI-compatible address, up to and without /chat/completions.
    #[arg(long, requires = "model")]
    model_url: Option<String>,
    /// The model's name on that server.
    #[arg(long, requires = "model_url")]
    model: Option<String>,
    /// Environment variable that holds its key.
    #[arg(long, requires = "model_url", value_name = "VARIABLE")]
    model_key_env: Option<String>,
}

impl ModelArgs {
    /// The model, if one was given.
    pub(crate) fn chat(&self) -> anyhow::Result<Option<ChatModel>> {
        let (Some(url), Some(model)) = (&self.model_url, &self.model) else {
            return Ok(None);
        };
        let mut config = ModelConfig::new(url, model);
        config.key_variable.clone_from(&self.model_key_env);
        let chat = ChatModel::new(config).map_err(|error| BadInput(error.to_string()))?;
        Ok(Some(chat))
    }
}

/// Plans and prints.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let plan = plan(&args.instruction, args.model.chat()?.as_ref())?;
    if args.json {
        println!(
            "{}",
            serde_json::to_string_pretty(&PlannerOutput::from_plan(&plan))?
        );
    } else {
        print(&plan);
    }
    Ok(if plan.understood() {
        Exit::Done
    } else {
        Exit::Negative
    })
}

/// The rules' plan, or the model's where the rules are unsure.
pub(crate) fn plan(instruction: &str, model: Option<&ChatModel>) -> anyhow::Result<TaskPlan> {
    let plan = planner::plan(instruction).map_err(|error| BadInput(error.to_string()))?;
    let Some(model) = model.filter(|_| plan.confidence < SURE) else {
        return Ok(plan);
    };
    let user = format!("Instruction: {}", serde_json::Value::from(instruction));
    let (answer, _) = model.ask(prompts::PLANNER, &user, None, &Cancel::default());
    let output = answer
        .map_err(anyhow::Error::from)
        .and_then(|answer| Ok(PlannerOutput::from_model(&answer, instruction)?));
    match output {
        Ok(output) if output.confidence.min(SURE) > plan.confidence => {
            let confidence = output.confidence.min(SURE);
            Ok(TaskPlan {
                confidence,
                ..output.into_plan()
            })
        }
        Ok(_) => Ok(plan),
        Err(error) => {
            eprintln!("fitmac: the model didn't help: {error:#}; the rules' plan stands");
            Ok(plan)
        }
    }
}

fn print(plan: &TaskPlan) {
    if !plan.understood() {
        println!(
            "Not understood (confidence {:.2}): left to the policy.",
            plan.confidence
        );
    } else {
        for (number, step) in plan.subtasks.iter().enumerate() {
            println!("{}. {}", number + 1, step.text);
        }
        println!("confidence {:.2}", plan.confidence);
    }
    for doubt in &plan.doubts {
        println!("doubt: {doubt:?}");
    }
}
