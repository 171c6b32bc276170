//! The planner's phrases.

use super::lexer::{Direction, Verb};
use super::types::Relation;

/// Meaning of a phrase.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entry {
    Verb(Verb),
    Prep(Option<Relation>, Direction),
    /// A place without a reference; only where the phrase ends.
    Place(Relation),
    /// "Towards": to, but how far is left open.
    Towards,
    Determiner,
    Of,
    Possessive,
    Not,
    Relative,
    Goes,
    Want,
    Both,
    And,
    Then,
    Comma,
    Stop,
    It,
    Them,
    Unsupported,
    /// Politeness, adverbs and particles: dropped.
    Skip,
}

/// Phrases by meaning, separated by `|`; longer phrases win.
pub(super) const TABLE: &[(Entry, &str)] = {
    use Direction::{From, Static, To};
    use Entry as E;
    use Relation as R;
    &[
        (
            E::Verb(Verb::Pick),
            "pick up|pick|pick out|grab|grasp|grip|take hold of|get hold of|take up|lift|lift up",
        ),
        (
            E::Verb(Verb::Get),
            "get|take|fetch|retrieve|collect|raise|hold|seize|remove",
        ),
        (E::Verb(Verb::Find), "find|locate|select|choose|identify"),
        (
            E::Verb(Verb::Place),
            "place|put|set|lay|rest|drop|deposit|release|lower|stand|position|store|stow|add|load|toss|insert|pack|stack|arrange|return|hang|mount|fit|place back|put back|dump|slot|park|tuck|plop|situate|put down|set down|place down|lay down|drop off|throw|chuck|plunk|pop",
        ),
        (
            E::Verb(Verb::Move),
            "move|transfer|shift|bring|carry|relocate|transport|deliver|pick and place|haul",
        ),
        (E::Verb(Verb::Leave), "leave|keep"),
        (E::Verb(Verb::Slide), "slide"),
        (E::Verb(Verb::Push), "push|shove|nudge"),
        (E::Verb(Verb::Open), "open|pull open|open up"),
        (E::Verb(Verb::Close), "close|shut|push closed"),
        (E::Verb(Verb::TurnOn), "turn on|switch on|power on"),
        (E::Verb(Verb::TurnOff), "turn off|switch off|power off"),
        (E::Verb(Verb::Turn), "turn|switch"),
        (
            E::Prep(Some(R::On), Static),
            "on|upon|atop|right on|straight on|right on top of|on top of|on the top of|back on|on to the top of|at the top of",
        ),
        (
            E::Prep(Some(R::On), To),
            "onto|on to|over onto|back onto|right onto|straight onto|right on to|straight on to|to the top of|onto the top of|onto top of",
        ),
        (
            E::Prep(Some(R::On), From),
            "off|off of|off from|from on|from atop|from on top of|from the top of|off the top of|from top of",
        ),
        (
            E::Prep(Some(R::In), Static),
            "in|inside|inside of|within|back in|on the inside of|right in|straight in|right inside",
        ),
        (
            E::Prep(Some(R::In), To),
            "into|back into|to the inside of|right into|straight into",
        ),
        (
            E::Prep(Some(R::In), From),
            "out of|from inside|from inside of|from within|from in|out from|from out of",
        ),
        (E::Prep(None, To), "to|over to|back to|straight to"),
        (E::Towards, "toward|towards"),
        (E::Prep(None, From), "from|away off"),
        (E::Prep(None, Static), "at"),
        (
            E::Prep(Some(R::NextTo), Static),
            "next to|beside|near|near to|close to|by|adjacent to|alongside|to the side of|at the side of|by the side of|right next to|nearby|right beside|immediately next to",
        ),
        (
            E::Prep(Some(R::NextTo), From),
            "from next to|from beside|from near|from the side of",
        ),
        (
            E::Prep(Some(R::Between), Static),
            "between|in between|in the middle between",
        ),
        (
            E::Prep(Some(R::Between), From),
            "from between|from in between",
        ),
        (
            E::Prep(Some(R::LeftOf), Static),
            "left of|to the left of|on the left of|at the left of|on the left side of|to the left side of|at the left side of|on the left hand side of",
        ),
        (
            E::Prep(Some(R::LeftOf), From),
            "from the left of|from the left side of",
        ),
        (
            E::Prep(Some(R::RightOf), Static),
            "right of|to the right of|on the right of|at the right of|on the right side of|to the right side of|at the right side of|on the right hand side of",
        ),
        (
            E::Prep(Some(R::RightOf), From),
            "from the right of|from the right side of",
        ),
        (
            E::Prep(Some(R::InFrontOf), Static),
            "in front of|to the front of|at the front of|on the front of|before the front of|on the front side of",
        ),
        (
            E::Prep(Some(R::InFrontOf), From),
            "from the front of|from in front of",
        ),
        (
            E::Prep(Some(R::Behind), Static),
            "behind|in back of|at the back of|to the back of|to the rear of|at the rear of|in the rear of|on the back side of",
        ),
        (
            E::Prep(Some(R::Behind), From),
            "from behind|from the back of",
        ),
        (
            E::Prep(Some(R::AtCentre), Static),
            "at the center of|at the centre of|in the center of|in the centre of|in the middle of|at the middle of|on the center of|on the centre of|on the middle of|to the center of|to the centre of|to the middle of",
        ),
        (
            E::Prep(Some(R::AtCentre), From),
            "from the center of|from the centre of|from the middle of",
        ),
        (
            E::Prep(Some(R::Under), Static),
            "under|underneath|beneath|below",
        ),
        (
            E::Prep(Some(R::Under), From),
            "from under|from underneath|from beneath|from below",
        ),
        (
            E::Prep(Some(R::NearestTo), Static),
            "nearest|nearest to|closest|closest to",
        ),
        (
            E::Prep(Some(R::FarthestFrom), Static),
            "farthest from|furthest from|farthest away from|furthest away from",
        ),
        (
            E::Place(R::AtLeft),
            "on the left|at the left|to the left|on the left side|on the left hand side|from the left",
        ),
        (
            E::Place(R::AtRight),
            "on the right|at the right|to the right|on the right side|on the right hand side|from the right",
        ),
        (E::Place(R::AtFront), "at the front|in the front|in front"),
        (E::Place(R::AtBack), "at the back|in the back|at the rear"),
        (
            E::Place(R::AtCentre),
            "in the middle|at the center|at the centre|in the center|in the centre|from the center|from the centre|from the middle",
        ),
        (E::Determiner, "the|a|an|this|these|those|some|my|our|that"),
        (E::Of, "of"),
        (E::Possessive, "'s"),
        (
            E::Not,
            "not|isn't|is not|wasn't|aren't|doesn't|does not|'s not|that isn't|that is not|that 's not|which isn't|which is not|which 's not|that does not|that doesn't|which does not|which doesn't|that are not|that was not",
        ),
        (
            E::Relative,
            "thats|that is|that 's|which is|which 's|that was|which was|that are|which are|that sits|which sits|that stands|that lies|that rests|that has been|located|situated|sitting|standing|lying|resting|placed|positioned|found|kept|sit|sits|stands|lies|rests|currently|which|stored|lie|being",
        ),
        (
            E::Goes,
            "goes|go|should go|must go|needs to go|has to go|ought to go|is to go|belongs|should be put|should be placed|should be moved|should be set|must be put|must be placed|must be moved|needs to be put|needs to be placed|needs to be moved|has to be put|has to be placed|has to be moved|to be put|to be placed|to be moved|is to be put|is to be placed|is to be moved|should end up",
        ),
        (
            E::Want,
            "i want|i need|i would like|i 'd like|i'd like|we need|we want|make sure|make sure that|ensure|ensure that|i wish",
        ),
        (E::Both, "both|both of"),
        (E::And, "and|&"),
        (
            E::Then,
            "then|after that|afterwards|next|and then|and next|and after that|and afterwards|finally|lastly|secondly|and finally",
        ),
        (E::Comma, ","),
        (E::Stop, ".|;|!|?"),
        (E::It, "it"),
        (
            E::Them,
            "them|them both|both of them|them all|they|these two",
        ),
        (
            E::Unsupported,
            "gripper|elbow|wrist|joint|joints|eleven|twelve|hundred|thrice|your|more|most|less|fewer|enough|extra|half|few|couple|pair|dozen|lot|lots|bit|grandma|grandpa|mom|mum|dad|someone|somebody|everyone|anyone|human|person|people|user|yourselves|the rest|the others|the remaining|its|own|non|yourself|myself|itself|hand|hands|arm|arms|finger|fingers|or|if|unless|until|while|before|after|when|once|don't|do not|do|never|everything|anything|nothing|something|all|every|each|any|two|three|four|five|six|seven|eight|nine|ten|several|many|except|without|instead|same|where|what|who|whose|why|how|other|another|else|neither|nor|either|ignore|disregard|forget|me|us|him|her|you|i|away|there|here|one|ones|first|second|third|fourth|last|again|avoid|rid|but|because|so|not the|rather|twice|as|for|about|against|through|along|around|across|above|than|is|are|was|be|been|will|would|can't|cannot|won't|shouldn't|no|only|whichever|wherever|putting|placing|picking|moving|taking|holding",
        ),
        (
            E::Skip,
            "please|kindly|could you|could you please|can you|can you please|would you|would you please|will you|you should|you must|you need to|you have to|i want you to|i need you to|i would like you to|i 'd like you to|i'd like you to|we need you to|your task is to|your job is to|your goal is to|the task is to|the goal is to|task|robot|hey robot|dear robot|now|let 's|go and|make the robot|have the robot|get the robot to|tell the robot to|the robot should|the robot must|use the gripper to|use your gripper to|use the robot to|use the arm to|use the robot arm to|with the gripper|what action should the robot take to|what should the robot do to|try to|ok|okay|gently|carefully|quickly|slowly|softly|simply|just|safely|directly|precisely|firmly|neatly|up|down|over there|right here|for me|also|hey|firstly|to start",
        ),
    ]
};
