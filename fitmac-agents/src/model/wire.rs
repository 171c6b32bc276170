//! The protocol's messages, as far as they are used.

use base64::Engine as _;
use serde::{Deserialize, Serialize};

/// A request for one answer.
#[derive(Clone, Debug, Serialize)]
pub struct ChatRequest {
    /// The model's name on the server.
    pub model: String,
    /// System and user message.
    pub messages: Vec<Message>,
    /// 0: the likeliest answer.
    pub temperature: f64,
    /// Longest answer, tokens.
    pub max_tokens: u32,
    /// Asks the server for JSON.
    pub response_format: ResponseFormat,
}

/// The kind of answer wanted.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ResponseFormat {
    #[serde(rename = "type")]
    kind: &'static str,
}

impl ResponseFormat {
    /// One JSON object.
    pub const JSON: Self = Self {
        kind: "json_object",
    };
}

/// One message.
#[derive(Clone, Debug, Serialize)]
pub struct Message {
    role: &'static str,
    content: Vec<Part>,
}

/// Text or an image.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum Part {
    Text { text: String },
    ImageUrl { image_url: ImageUrl },
}

#[derive(Clone, Debug, Serialize)]
struct ImageUrl {
    url: String,
}

impl Message {
    /// The system's message.
    #[must_use]
    pub fn system(text: &str) -> Self {
        Self {
            role: "system",
            content: vec![Part::Text {
                text: text.to_owned(),
            }],
        }
    }

    /// The user's message, with an image as PNG if there is one.
    #[must_use]
    pub fn user(text: String, png: Option<&[u8]>) -> Self {
        let mut content = vec![Part::Text { text }];
        if let Some(png) = png {
            let data = base64::engine::general_purpose::STANDARD.encode(png);
            let url = format!("data:image/png;base64,{data}");
            content.push(Part::ImageUrl {
                image_url: ImageUrl { url },
            });
        }
        Self {
            role: "user",
            content,
        }
    }
}

/// The answer; unknown fields are the server's business.
#[derive(Debug, Deserialize)]
pub(super) struct ChatResponse {
    pub(super) choices: Vec<Choice>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Choice {
    pub(super) message: Answer,
    #[serde(default)]
    pub(super) finish_reason: Option<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Answer {
    #[serde(default)]
    pub(super) content: Option<String>,
    #[serde(default)]
    pub(super) refusal: Option<String>,
}
