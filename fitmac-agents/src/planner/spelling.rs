//! Slips of the keyboard.
//!
//! A word that the planner doesn't know is read as the one word that it does
//! know and that a single slip away: a letter left out, doubled, wrong or
//! exchanged with its neighbour. If there are two such words, or the word is
//! short, it stays as it is. A parse that rests on this is never reported as
//! sure.

use super::lexicon;

/// Least length at which a slip other than an exchange is undone, of the
/// longer of the two words.
const LENGTH_MIN: usize = 5;

/// The word that was meant, if there is exactly one.
pub(super) fn meant(word: &str) -> Option<&'static str> {
    if word.len() < 3 || !word.bytes().all(|byte| byte.is_ascii_lowercase()) {
        return None;
    }
    let slips = |which: Slip| {
        let slip = move |known: &&str| slip(word.as_bytes(), known.as_bytes()) == Some(which);
        let mut found = lexicon::known_words().filter(slip);
        (found.next(), found.next())
    };
    // Exchanged letters are all there: no other slip is as likely.
    match (slips(Slip::Exchange), slips(Slip::Letter)) {
        ((Some(one), None), _) => Some(one),
        ((None, None), (Some(one), None)) if one.len().max(word.len()) >= LENGTH_MIN => Some(one),
        _ => None,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slip {
    Exchange,
    Letter,
}

/// The slip that turns `meant` into `typed`, if one does.
fn slip(typed: &[u8], meant: &[u8]) -> Option<Slip> {
    let (short, long) = if typed.len() < meant.len() {
        (typed, meant)
    } else {
        (meant, typed)
    };
    if long.len() - short.len() > 1 || short.len() < 2 {
        return None;
    }
    // "Sticky", "lower", "colored" are words of their own.
    if typed
        .strip_prefix(meant)
        .is_some_and(|end| end.iter().all(|letter| b"dnrsy".contains(letter)))
    {
        return None;
    }
    let same = short.iter().zip(long).take_while(|(a, b)| a == b).count();
    if short.len() == long.len() {
        let rest = |at: usize| short.get(at..) == long.get(at..);
        let exchanged = short.get(same) == long.get(same + 1)
            && short.get(same + 1) == long.get(same)
            && rest(same + 2);
        let wrong = same > 0 && rest(same + 1);
        match (exchanged, wrong) {
            (true, _) => Some(Slip::Exchange),
            (_, true) => Some(Slip::Letter),
            _ => None,
        }
    } else {
        let missed = short.get(same..) == long.get(same + 1..);
        (same > 0 && missed).then_some(Slip::Letter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slip_is_undone_and_a_choice_is_not_made() {
        for (typed, meant_word) in [
            ("blak", Some("black")),
            ("teh", Some("the")),
            ("pikc", Some("pick")),
            ("ramekim", Some("ramekin")),
            ("baskett", Some("basket")),
            ("bown", None),
            ("palce", Some("place")),
            ("sticky", None),
            ("xyz", None),
            ("cip", None),
            ("panier", None),
        ] {
            assert_eq!(meant(typed), meant_word, "{typed}");
        }
    }
}
