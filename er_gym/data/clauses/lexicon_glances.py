"""The words by which :mod:`er_gym.data.clauses.glances` reads clauses, by language."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from er_gym.data.clauses.lexicon import Words
from er_gym.data.phrases import MARK
from er_gym.data.trajectory import Language

ByLanguage = Mapping[Language, Words]
_X, _Y = f"(?P<x>{MARK})", f"(?P<y>{MARK})"


def _words(english: str, chinese: str) -> ByLanguage:
    return {"en": re.compile(english), "zh": re.compile(chinese)}


def _phrases(
    english: tuple[str, ...], chinese: tuple[str, ...]
) -> Mapping[Language, Sequence[Words]]:
    return {
        "en": tuple(re.compile(each) for each in english),
        "zh": tuple(re.compile(each) for each in chinese),
    }


BEFORE_ME = _words(
    r"\b(?:in front of|before|beside|next to|facing|opposite) me\b|\bbefore my (?:very )?eyes\b"
    r"|\b(?:under|beneath) my (?:very )?(?:nose|eyes)\b|\bat my (?:feet|side|elbow|left|right)\b|\bby my side\b"
    r"|\bin (?:plain |full |clear |good )*(?:view|sight)\b(?! of)|\bvisible\b|\bwithin (?:sight|view|eyeshot)\b"
    r"|\b(?:to|on) (?:my|the) (?:immediate |far |near )?(?:left|right)\b(?! of)|\b(?:straight|dead|directly) ahead\b"
    r"|\bright here\b|\b(?:stares?|staring|looks?|looking|winks?|smiles?|grins?|gleams?|glints?|shines?) (?:[a-z]+ )?(?:at|back at) me\b"
    r"|\bin the face\b|\bcatch(?:es|ing)? my eye\b|\bmeets? my (?:eye|gaze)s?\b|\bgreets? me\b|\bfaces? me\b",
    r"眼前|面前|跟前(?!的)|眼皮子?底下|鼻子底下|手边|身边|脚边|视野(?:里|中|内)|视线(?:里|中|内)|看得(?:到|见|清)|望得(?:到|见)"
    r"|瞧得见|映入眼帘|一眼(?:就)?(?:看|望|瞧)|正对着我|正前方|(?:我|就在)的?(?:左|右)(?:手)?边|就在(?:左|右|旁)",
)
"""Says that what is spoken of is here, in view."""
VIEW_OF = _phrases(
    (
        rf"\b(?:i|i'm|i've|i'd)(?: (?:can|am|still|now|also|even|just|clearly|plainly|have|got|get))* "
        rf"(?:(?:a |the )?(?:fine |good |clear |full |perfect |nice |plain |lovely |great )?view of|looking (?:right |straight )?at|gazing at|facing|staring at|see|sees|make out"
        rf"|spot|behold|beholding|seeing) (?:(?!not\b|no\b|where\b|how\b|why\b|what\b|if\b|in\b|on\b|to\b|of\b)[a-z'-]+ ){{0,3}}{_X}",
    ),
    (
        rf"(?:我)?(?:还|仍|也|都|正|现在|这会儿|此刻|从这里|从这儿|清楚地|明明|又)*(?:看得到|看得见|望得见|瞧得见|能看到|能看见|正看着|正望着|正对着|面对着)(?:[\u4e00-\u9fff]{{1,4}}的)?(?:那|这)?(?:[一两]?[个只张把台扇块条])?{_X}",
        rf"{_X}(?:我)?(?:也|都|还|就|明明|清清楚楚)*(?:看得到|看得见|看得清|望得见|瞧得见)",
    ),
)
"""Says that ``x`` is seen now."""
IS_SEEN = (
    re.compile(
        rf"{_X} (?:[a-z]+ly )?(?:hums|ticks|gleams|glints|glitters|sparkles|looms|towers|beckons|stares|blinks|winks|purrs|stretches"
        rf"|sprawls|yawns|smiles|grins|shimmers)\b"
    ),
    re.compile(
        rf"\b(?:hums|ticks|gleams|glints|looms|towers|stretches|stands|hangs|sits|dangles|beckons) (?:the|a|an|my) (?:[a-z-]+ )?{_X}(?=$|[,.;!])"
    ),
)
"""English: who tells that has it before the eyes."""
TURNED = _words(
    r"\b(?:not|no|never|nor|neither|none|was|were|had|used to|if|when|whenever|until|till|once|would|could|might|may|should"
    r"|must|imagine|picture|as if|as though|like|need|needs|want|wanted|looking for|out of|will|soon|later|again|after|hope"
    r"|remember|recall|memory|saw|seen|earlier|before(?! me\b| my\b)|somewhere|other|another|else|than|without|hardly|let|going to|to (?:be|get|have|bring|see|find|put))\b|n't\b|'ll\b|\?",
    r"没|不|未|无|别|如果|要是|假如|可能|也许|或许|应该|大概|会(?!儿)|要(?!紧|命)|想|等|时候|之前|刚才|刚刚|原来|原先|当时|曾|记得|过(?!来)|才|像|以为|除|吗|哪|另|再|一般|通常|往|去|找|把(?!手)|将|从(?!这)|走|(?:来|回|赶|凑|跑|挪|移|站)到",
)
"""Words that may turn the sense of such a claim."""
PERCEIVED = _words(
    r"\b(?:seen|see|saw|noticed?|spotted|spot|met|encountered|come across|came across|laid eyes|set eyes|lay eyes|clapped eyes"
    r"|glimpsed?|glimpse|sight|sighted|crossed my path|cross my path|shown (?:up|itself|themselves)|show up|turned up|turn up"
    r"|appeared|appear|caught my eye|run into|ran into|observed|showed (?:up|itself)|popped up|in (?:view|sight))\b",
    r"看到|看见|见到|见过|见着|见|瞧见|瞧到|瞥见|碰上|碰到|碰见|遇到|遇上|发现|露面|露脸|露过|出现|现身|现过身|影子|踪影|踪迹|印象|照面|瞅见|入眼|入过眼",
)
"""A thing is seen, or comes into view."""
NEVER = _words(
    rf"\bnever\b|\byet to\b|\bnot an? {MARK} (?:have|has|did)\b|\b(?:have|has|had|'ve)(?: (?:yet|still|so far))? (?:not|n't)\b|\b(?:haven't|hasn't|hadn't)\b|\bnot (?:once|one|a single|at any point|ever|even once|so much)\b"
    r"|\b(?:can't|cannot|couldn't|don't|wouldn't|didn't|did not|do not) (?:[a-z']+ ){0,6}ever\b|\bno [^,.]{0,25}\bever\b|\b(?:doubt|deny)\b[^,.]{0,30}\bever\b"
    r"|\bnot [^,.]{0,30}\b(?:so far|all this time|since i (?:came|walked|entered|arrived|started|got))\b|\bno (?:sight|glimpse|sign|trace) of\b[^,.]{0,30}\b(?:so far|yet|all this time|until now|to date)\b"
    r"|\b(?:has|have|remains?|stayed|kept)\b[^,.]{0,15}\b(?:unseen|hidden from me|out of my sight)\b",
    r"(?:从来|从|至今|到现在|到目前|目前为止|始终|一直|一次|一眼|一回|压根|根本|从头到尾|一路|迄今|到这会儿|进来以后|自始至终)[^，。]{0,10}(?:没|未|不曾|没有)|(?:没|没有|未|不曾)(?:有)?[^，。]{0,5}过|毫无印象|没有?(?:半点|一点|任何)?印象",
)
"""Ever since the beginning, not once."""
SINCE_START = _words(
    r"\bsince(?:$| (?:i (?:first )?(?:came|walked|entered|arrived|started|began|got|set foot)|(?:walking|coming|arriving|entering|getting|setting foot))(?: (?:in|into|through|here|to|this|the)\b)*(?: (?:room|door|place|kitchen|bathroom|bedroom|house|living room))?)"
    r"|\b(?:in|around) (?:this|the) (?:room|place|kitchen|bathroom|bedroom|house|living room)\b|\bso far\b|\byet\b|\bin here\b|\bup to now\b|\buntil now\b|\bto this (?:moment|day|minute)\b|\bup to this (?:moment|minute)\b",
    r"(?:从|自从|打)?(?:我)?(?:进|走进|来到|来)(?:了)?(?:这|这个|这间)?(?:门|屋|屋子|房间|厨房|浴室|卧室|客厅|这里|这儿)?(?:以来|以后|之后|后|起)?(?:一直)?(?:到现在|到这会儿|至今|以来)|到(?:现在|目前|此刻|这会儿)(?:为止)?|(?:直到|直至)(?:现在|目前|此刻)|(?:在)?这(?:个|间)?(?:房间|厨房|浴室|卧室|客厅|屋子?)(?:里)?|迄今(?:为止)?",
)
"""A time or place that limits nothing."""
LIMITS = _words(
    rf"\b(?:from here|now|in this view|this time|at the moment|currently|right now|since|again|any ?more|up close|clearly|properly|lately|from this|inside it|closely|in it|on it|whole"
    rf"|other|another|else|second|more|open|opened|closed|used|move|moved|empty|near|nearer|like|such|so (?:close|clean|many)|from)\b|\b(?:in|on|inside|at|by|under|behind|near|with|of (?:the|this|that)) (?:the |this |that |any |my |a )?(?:[a-z-]+ )?{MARK}",
    rf"现在|这儿|眼下|此刻|此处|当前|角度|方向|这边|再|清楚|仔细|别的|其他|另|第二|在{MARK}|{MARK}(?:里|上|中|旁|那|后|下|内|跟|边)|打开|里面|哪个|这么|这样|拿|碰过|动过|用过",
)
"""Limits what was never seen to a place or time, or to things of some kind."""
WHERE = _words(
    r"\bwhere (?:on earth |in the world |exactly |else )?(?:could|can|might|may|is|are|did|has|have|do|does|would|should|the)\b|\b(?:no|not (?:a|the)(?: faintest| slightest| least)?|any|without a) (?:clue|idea|notion|hint|inkling)\b|\b(?:don't|do not|can't|cannot) (?:know|say|tell|imagine|think|guess) where\b|\bwhereabouts\b|\bhiding\b|\banyone's guess\b|\banybody's guess\b|\b(?:still )?(?:unaccounted for|to be found|to be located|missing)\b",
    r"在哪(?!边|个方|一边|头)|哪儿去|哪里去|上哪|去哪|何处|哪个角落|下落|没有?着落|没(?:有)?头绪|毫无头绪|没(?:有)?线索|找不着|无影无踪|猜不(?:到|出)|没准在|不知道[^，。]{0,6}(?:放|搁|藏|躲|丢|摆)",
)
"""The whereabouts of a thing are not known."""
RECALLED = _words(
    r"\b(?:saw|seen|noticed|spotted|remember|recall|recalled|was|were|lay|sat|stood|earlier|before|back|left|same|again|still|glimpsed|last|know|put|had|that one|took|taken)\b",
    r"见过|看到|看见|瞧见|瞥见|记得|刚才|之前|原来|还在|仍|当时|先前|回去|回到|回头|拿|放下|知道|还是|来着|方向",
)
"""It is told that it was seen, or was moved since."""
ASKED_EVER = _words(
    r"\b(?:did|have|had) i (?:ever|once|already|really|actually|not)?\b",
    r"见过|看到过|看见过|遇到过|碰到过|瞧见过|有没有见",
)
"""A question for what the agent has seen."""
ANSWERED_NO = _words(
    r"^(?:no|nope|never|not once|not (?:yet|ever|at all|that i)|i (?:did|have|had) not|i (?:didn't|haven't|hadn't)|hardly|certainly not|by no means)\b",
    r"^(?:没有|没|从没|从来没|一次也没|压根没|并没有|未曾|不曾|没见过)",
)
"""The answer to it: no."""
LAY = _phrases(
    (
        rf"{_X},?(?: (?:which|that))?(?: (?:still|also|already|first|originally|i (?:think|believe|recall|remember)|as i (?:recall|remember)|if i (?:recall|remember)(?: rightly| correctly)?|,))*,? (?:was|were|lay|sat|stood|had been|rested|hung|used to (?:be|lie|sit|stand)|had lain|had stood)"
        rf"(?: (?:[a-z]+(?<!not)(?<!never)(?<!on)(?<!in)(?<!for)(?<!to)(?<!by)(?<!near)(?<!from)(?<!beside)(?<!off)(?<!of)(?<!at)(?<!under)(?<!behind))){{0,3}} (?:on top of|on|in|inside|atop|upon|within) (?:the |a |an |that |this |one of the |its )?(?:[a-z-]+ )?{_Y}",
        rf"\b(?:saw|seen|noticed|spotted|remember|recall|found|glimpsed|came across)(?: seeing| having seen| there was| that)? (?:the |a |an |that |this |some |my )?(?:[a-z-]+ )?{_X}(?: (?:lying|sitting|standing|resting|perched|left|was|hanging|stood|being|placed|tucked))* (?:on top of|on|in|inside|atop|upon) (?:the |a |an |that |this )?(?:[a-z-]+ )?{_Y}",
    ),
    (
        rf"{_X}(?:(?![没不未要把将]|在{MARK})[\u4e00-\u9fff，]){{0,12}}?在(?:了)?(?:那|这)?(?:[张个只台把块条]?)(?:[\u4e00-\u9fff]{{1,3}}的)?{_Y}(?:的)?(?:上|里|中|内|角|边沿|顶)",
        rf"{_X}(?:我记得|是|当时|原先|原来|原本|本来|之前|刚才|先前|最初|一开始|起初|最早|那时|曾|就|明明|一直|我|看到的时候|看见的时候|的时候|，)*(?:摆|放|躺|搁|立|挂|待|靠|收|塞|装|留|落|插|搭)在(?:了)?(?:那|这)?(?:[张个只台把块]?){_Y}(?:的)?(?:上|里|中|内)",
        rf"{_Y}(?:的)?(?:里面|里头|上面|里|上|中)(?:当时|原先|原来|本来|之前|刚才|先前|那时|曾|就|还|只|明明|确实)*(?:躺着|放着|摆着|搁着|立着|挂着|装着|藏着|塞着|有)(?:过)?(?:一|两|几)?(?:[把个只张台块条本瓶])?(?:[\u4e00-\u9fff]{{1,3}}的)?{_X}",
    ),
)
"""``x`` was in or on ``y``."""
REMEMBERS = _words(
    r"\b(?:was|were|lay|sat|stood|had|hung|rested|saw|seen|noticed|spotted|remember|recall|used to|found|glimpsed|came across)\b",
    r"当时|原先|原来|原本|本来|之前|刚才|刚刚|先前|最初|一开始|起初|最早|那时|曾|记得|看到的|看见的|见到的|见过|看到过|的时候|第一个",
)
"""It is told of what was."""
