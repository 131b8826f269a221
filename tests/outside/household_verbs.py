"""A verb of another package: docs/extending.md."""

from er_gym.tasks.verbs import Verb, Words

CLEAN = Verb(
    name="clean",
    aliases=("wipe",),
    thor_action="CleanObject",
    object_property="dirtyable",
    object_state=("isDirty", True),
    hand=("DishSponge", "Cloth"),
    tool="a sponge or a cloth",
    makes=(("isDirty", False),),
    otherwise="It is clean already, or never gets dirty.",
    words={
        "en": Words(said=("wipe off", "scrub"), meaning="wipe an object with what you hold."),
        "zh": Words(said=("擦干净",), meaning="用手里的海绵或抹布擦干净物体。"),
    },
)
FILL = Verb(
    name="fill",
    thor_action="FillObjectWithLiquid",
    parameters={"fillLiquid": "water"},
    object_property="canFillWithLiquid",
    object_state=("isFilledWithLiquid", False),
    in_hand=True,
    makes=(("isFilledWithLiquid", True),),
)
CROUCH = Verb(name="crouch", aliases=("duck",), alone=True, thor_action="Crouch", scored=False)
