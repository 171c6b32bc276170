//! Vocabulary of names: which words are objects, modifiers, containers.

/// Vocabulary of nouns that head a name.
pub(super) const NOUNS: &str = "alphabet soup cheese dressing sauce ketchup butter milk pudding juice basket bowl plate ramekin box cabinet drawer stove table cookie burner bottle rack pot mug cup book caddy compartment microwave can carton tray pan shelf bin apple banana orange lemon pear peach tomato potato carrot onion egg bread block cube cylinder ball square circle triangle fork spoon knife spatula ladle towel cloth sponge soap brush pen pencil marker eraser phone remote lamp clock vase candle jar lid kettle pitcher glass saucer dish teapot toaster oven fridge refrigerator sink counter desk chair floor crate container bag pouch packet stick slice jug flask thermos shaker salt pepper sugar flour rice pasta macaroni cereal snack chips candy chocolate cake cookie biscuit donut yogurt cream mayonnaise mustard syrup honey jam oil vinegar wine beer coke soda water coffee tea toy bear car truck train doll puzzle die dice card cards key keys coin wallet watch hat shoe sock glove screw bolt nut nail hammer screwdriver wrench pliers tape ruler scissors cable plug battery charger mouse keyboard laptop tablet screen camera speaker headphones cap cover stand holder hook peg board mat pad coaster napkin tissue paper envelope folder notebook magazine stapler clip mushroom corn cucumber avocado strawberry grape mango kiwi lime pumpkin eggplant object item thing tin trash garbage spray cleaner detergent shampoo toothbrush toothpaste cupboard wardrobe dresser wall door handle side area spot region zone section corner edge top bottom middle center centre noodles beans tuna spam popcorn pringles nuts peanuts rubik letters frypan skillet saucepan wok cutlery barbecue bbq dispenser target goal pitaya pepper plant pumpkin squeezer cutter grater peeler whisk opener cork bucket bath tub hamper rim lego brick";

/// Vocabulary of modifiers.
pub(super) const MODIFIERS: &str = "black white red green blue yellow orange purple pink brown grey gray silver gold golden dark light pale beige transparent clear small large big tiny little huge tall short long wide narrow thin thick round square flat wooden metal metallic plastic glass ceramic porcelain paper cardboard steel iron wicker akita left right top bottom middle upper lower front back rear center centre central leftmost rightmost nearest biggest smallest largest tallest shortest empty full open closed heavy new old striped spotted cream cookie wine moka alphabet tomato salad bbq barbecue chocolate orange frying trash desk coffee kitchen dining white black grocery storage soft hard fresh canned glazed plain colored coloured bright hot cold boxed bottled inner outer first-aid milk soup butter ketchup tea soda water cheese juice sauce pudding toy and with dark-red round-shaped cylindrical rectangular office stainless pepper salt";

/// References into which things go; "to the basket" means in it.
pub(super) const CONTAINERS: &str = "basket bowl drawer compartment bin microwave crate container oven fridge refrigerator sink bag caddy jar mug cup pot pan bucket trash garbage cupboard hamper carton";

/// Parts of the house: nobody picks them up.
pub(super) const FIXED: &[&str] = &[
    "door",
    "drawer",
    "cabinet",
    "stove",
    "table",
    "fridge",
    "refrigerator",
    "oven",
    "sink",
    "counter",
    "desk",
    "floor",
    "wall",
    "cupboard",
    "wardrobe",
    "dresser",
    "burner",
    "compartment",
    "bath",
    "tub",
];

/// References onto which things go; "to the plate" means on it.
pub(super) const SURFACES: &[&str] = &[
    "plate",
    "stove",
    "table",
    "cabinet",
    "shelf",
    "tray",
    "counter",
    "desk",
    "rack",
    "burner",
    "board",
    "mat",
    "pad",
    "coaster",
    "napkin",
    "saucer",
    "floor",
    "chair",
    "stand",
    "top",
    "dresser",
    "workbench",
    "bench",
    "holder",
    "dish",
    "towel",
    "hook",
    "scale",
];

/// Regions of an object: no objects of their own.
pub(super) const REGIONS: &str = "handle knob top bottom side edge corner front back rear left right middle center centre area region zone section spot rim surface inside outside end half";

/// Names joined by "and" that are one object.
pub(super) const COMPOUNDS: &[&str] = &["macaroni and cheese", "mac and cheese"];

/// Colours: "the yellow and white mug" is one mug.
pub(super) const COLOURS: &str =
    "black white red green blue yellow orange purple pink brown grey gray silver gold golden beige";
