"""Deeds that no action of the agent does, by language, and answers that no engine gives."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from er_gym.data.clauses.lexicon import Words
from er_gym.data.phrases import MARK
from er_gym.data.trajectory import Language
from er_gym.tasks import verbs


@dataclass(frozen=True)
class Beyond:
    """A kind of deed beyond the agent's actions.

    Attributes:
        done: it was done to ``x``, by language.
        by: the deeds that come near enough to it for a thought to call them so: each a verb with
            the types, empty for any.
    """

    done: Mapping[Language, Sequence[Words]]
    by: Sequence[tuple[str, frozenset[str]]] = ()


_ADVERBS = r"(?: (?:already|just|now|also|even|first|then|carefully|thoroughly|quickly|neatly|duly|only|kindly|twice|both|all|[a-z]+ly))*"
_THE = r"(?:the |a |an |that |this |those |these |its |my |both |all |each |every |some )?(?:[a-z-]+ ){0,2}"
_OFF = r"(?: (?:off|out|up|down|clean|dry|away|over|well|under the tap|through))?"


def _beyond(english: str, chinese: str, by: Sequence[tuple[str, frozenset[str]]] = ()) -> Beyond:
    """A kind of deed, by its English participles and its Chinese verbs."""
    return Beyond(
        {
            "en": (
                re.compile(
                    rf"(?:\b(?:i|we)(?:'ve|'d| have| had)?|\bhaving|\bafter|(?<=§)[^§.;?]{{0,30}}(?:,| and))(?: i)?{_ADVERBS} (?:{english}){_OFF} {_THE}(?P<x>{MARK})"
                ),
                re.compile(
                    rf"(?P<x>{MARK})(?: (?:has|have|had|'s|'d)|'s|'ve){_ADVERBS} been{_ADVERBS} (?:{english})\b"
                ),
                re.compile(
                    rf"(?P<x>{MARK}) (?:was|were|got|is|are|comes|came){_ADVERBS} (?:freshly |newly |nicely )?(?:{english})\b(?! (?:with|in|of|for|to) )"
                ),
                re.compile(
                    rf"\bi(?:'ve|'d| have| had)? (?:gave|given|give) {_THE}(?P<x>{MARK}) (?:a|its|one) (?:[a-z]+ )?(?:{english.replace('ed', '')})(?![a-z])"
                ),
            ),
            "zh": (
                re.compile(
                    rf"(?P<x>{MARK})(?:我|已经|刚才|刚刚|也|都|早就|先|被我|让我|给|在[^，。]{{0,4}}里|用[^，。§]{{0,4}}|好好|仔细|顺手|亲手|已|早|刚|全|全都|统统|里里外外)*(?:{chinese})(?:得|了|过|好|干净|完|掉|成|净|齐|平|整齐|干|出来|上|下来)"
                ),
                re.compile(
                    rf"(?:把|将|给)(?:那|这)?(?:[个只张把台块条件本]?)(?P<x>{MARK})(?:都|也|先|给|好好|仔细|里里外外|全)*(?:{chinese})(?:得|了|过|好了|干净|完|掉|成|净了|齐|平|整齐|干了|出来|进|在)"
                ),
                re.compile(
                    rf"(?:我|已经|刚才|刚刚|早就)(?:先|就|也|亲手|顺手|已经|刚|好好)*(?:{chinese})(?:了|过|好了|干净了|完了)(?:那|这)?(?:[一两]?[个只张把台块条件本遍])?(?P<x>{MARK})"
                ),
            ),
        },
        by,
    )


_SINKS = frozenset({"Sink", "SinkBasin", "Bathtub", "BathtubBasin"})
_HOT = frozenset({"Microwave", "StoveBurner", "Toaster", "Pan", "Pot", "CoffeeMachine"})
_COLD = frozenset({"Fridge"})

DEEDS: Sequence[Beyond] = (
    _beyond(
        "rinsed|washed|soaked|scrubbed|wrung|dunked",
        "洗|涮|冲洗|清洗|浸泡|泡|拧(?!开|上)",
        ((verbs.PUT, _SINKS), (verbs.TOGGLE, frozenset({"Faucet", "ShowerHead"}))),
    ),
    _beyond(
        "wiped|dusted|polished|dried|mopped|vacuumed|hoovered|swept|ironed|folded|unfolded|straightened"
        "|plumped|fluffed|smoothed|tidied|stacked|rearranged|arranged|aligned|untied|tied|wrapped|unwrapped"
        "|plugged|unplugged|charged|recharged|watered|repaired|mended|repainted|painted|sharpened|sewn|stitched"
        "|photographed|weighed|dialled|leafed|torn|ripped|smashed|shattered|bitten|eaten|drunk|sipped|tasted"
        "|salted|peppered|peeled|stirred|whisked|flushed|greased|stripped|shaken|kicked|hammered|glued|taped",
        "擦(?!肩)|抹|拭|掸|扫|拖|叠|熨|抚|铺|拍|整理|摆正|扶正|拉平|捆|绑|包(?!在)|插电|充电|充好|浇|修(?!改)|磨|缝|拍照|称"
        "|撕|砸|摔|咬|吃|喝|尝|剥|削|搅|打散|打匀|冲水|粘|贴|读|翻译|晾|晒|拧干",
    ),
    _beyond(
        "emptied|poured|filled|refilled|drained|topped",
        "倒(?!是|也|在|好|不|还|有|没)|灌|斟|盛满|装满|倒满|倒空|灌满",
    ),
    _beyond(
        "cooked|fried|boiled|baked|roasted|toasted|grilled|steamed|heated|warmed|microwaved|simmered",
        "煮|煎|炒|炸|蒸|烤|加热|焖|炖|热(?=好|了|过)",
        ((verbs.PUT, _HOT), (verbs.TOGGLE, _HOT)),
    ),
    _beyond(
        "chilled|cooled|frozen|refrigerated",
        "冰镇|冷冻|冷却|冷藏|冻",
        ((verbs.PUT, _COLD), (verbs.CLOSE, _COLD)),
    ),
    _beyond(
        "cracked|beaten|broken|sliced|chopped|carved|diced|minced|quartered",
        "切|剁|敲|打碎|打破|打(?=进|在|到)|劈",
        ((verbs.SLICE, frozenset()),),
    ),
)
"""Every kind."""
NEVER_ANSWERED: Mapping[Language, Words] = {
    "en": re.compile(
        r"\b(?:too heavy|heavy|jammed|locked|stuck|sealed|fragile|too hot|too big|too large|too small|too full|is full|forbidden"
        r"|not allowed|permission|no permission|unavailable|out of order|broken|busy|not found|doesn't exist|does not exist|no such place"
        r"|occupied|slippery|glued|asleep|battery|wait|not enough|overloaded|full up|already in use)\b"
    ),
    "zh": re.compile(
        r"太重|过重|太沉|卡住|卡死|锁着|上锁|锁住|锁了|封住|易碎|太烫|过热|太大|太小|满了|已满|禁止|不允许|不准|权限|损坏|坏了|故障|占用|不存在|找不到该|未找到|太滑|湿|电量|没电|超载|忙|请稍"
    ),
}
"""Reasons that the engine never gives for a refusal."""
