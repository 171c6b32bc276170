//! BERT's word pieces (uncased), as Grounding DINO reads its text.
//!
//! The greedy longest-match scheme of Devlin et al. 2019, for lower-case words
//! and punctuation; the vocabulary is the model's `vocab.txt`.

use std::collections::HashMap;

/// A vocabulary.
#[derive(Clone, Debug)]
pub struct WordPiece {
    pieces: HashMap<String, i64>,
    unknown: i64,
    start: i64,
    end: i64,
}

/// A vocabulary that lacks a special piece.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("vocabulary has no {0}: is it the vocab.txt of an uncased BERT?")]
pub struct VocabularyError(&'static str);

/// A text in pieces.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tokens {
    /// Piece numbers with start and end.
    pub ids: Vec<i64>,
    /// For each piece, the name that it belongs to, if any.
    pub names: Vec<Option<usize>>,
}

impl WordPiece {
    /// Reads a vocabulary, one piece a line; the line's number is the piece's.
    ///
    /// # Errors
    /// [`VocabularyError`] names a missing special piece.
    pub fn new(vocabulary: &str) -> Result<Self, VocabularyError> {
        let pieces: HashMap<String, i64> = vocabulary
            .lines()
            .zip(0..)
            .map(|(piece, id)| (piece.trim().to_owned(), id))
            .collect();
        let special =
            |piece: &'static str| pieces.get(piece).copied().ok_or(VocabularyError(piece));
        let (unknown, start, end) = (special("[UNK]")?, special("[CLS]")?, special("[SEP]")?);
        Ok(Self {
            pieces,
            unknown,
            start,
            end,
        })
    }

    /// "name . name ." in pieces, at most `capacity` of them; names that don't
    /// fit are left out whole.
    #[must_use]
    pub fn names(&self, names: &[String], capacity: usize) -> Tokens {
        let mut tokens = Tokens {
            ids: vec![self.start],
            names: vec![None],
        };
        let dot = self.pieces.get(".").copied().unwrap_or(self.unknown);
        for (index, name) in names.iter().enumerate() {
            let lower = name.to_lowercase();
            let mut ids = Vec::new();
            let words = lower
                .split(|c: char| !c.is_alphanumeric())
                .filter(|word| !word.is_empty());
            words.for_each(|word| self.word(word, &mut ids));
            if tokens.ids.len() + ids.len() + 2 > capacity {
                break;
            }
            tokens
                .names
                .extend(std::iter::repeat_n(Some(index), ids.len()));
            tokens.ids.append(&mut ids);
            tokens.ids.push(dot);
            tokens.names.push(None);
        }
        tokens.ids.push(self.end);
        tokens.names.push(None);
        tokens
    }

    fn word(&self, word: &str, ids: &mut Vec<i64>) {
        let begun = ids.len();
        let mut rest = word;
        while !rest.is_empty() {
            let prefix = if rest.len() == word.len() { "" } else { "##" };
            let ends = rest.char_indices().map(|(at, c)| at + c.len_utf8()).rev();
            let found = ends
                .filter_map(|end| {
                    let piece = format!("{prefix}{}", &rest[..end]);
                    self.pieces.get(&piece).map(|id| (end, *id))
                })
                .next();
            let Some((end, id)) = found else {
                // One unknown part makes the whole word unknown.
                ids.truncate(begun);
                ids.push(self.unknown);
                return;
            };
            ids.push(id);
            rest = &rest[end..];
        }
    }
}
