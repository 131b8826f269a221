"""The words of claims about purposes, failures and the agent's own earlier words, by language."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from er_gym.data.clauses import lexicon_en, lexicon_zh
from er_gym.data.clauses.lexicon import Words
from er_gym.data.phrases import MARK
from er_gym.data.trajectory import Language

_X, _Y = f"(?P<x>{MARK})", f"(?P<y>{MARK})"


@dataclass(frozen=True, kw_only=True)
class ReasonWords:
    """The words of a language.

    Attributes:
        goes_to: the task puts ``x`` in or on ``y``; without ``y``, in or on what the action is done
            to.
        reason: what follows is a reason.
        missing: ``x`` has not been found, or is lost.
        dropped: ``x`` was in the hand and fell.
        all_well: no action failed.
        except_one: but some did, or it is told of some time only.
        easily: ``x`` was taken at the first try.
        failed_with: an action with ``x`` failed.
        did_fail: a deed failed.
        fails_not: but not so, or it is told of something else.
        untouched: nothing was done to ``x``.
        not_next: the next action is not done to ``x``, by verb.
        own_words: the agent thought of ``x`` before.
        never_thought: it never thought of ``x``.
    """

    goes_to: Sequence[Words]
    reason: Words
    missing: Sequence[Words]
    dropped: Sequence[Words]
    all_well: Words
    except_one: Words
    easily: Sequence[Words]
    failed_with: Sequence[Words]
    did_fail: Words
    fails_not: Words
    untouched: Sequence[Words]
    not_next: Mapping[str, Sequence[Words]]
    own_words: Sequence[Words]
    never_thought: Sequence[Words]


def _all(*phrases: str) -> tuple[Words, ...]:
    return tuple(re.compile(each) for each in phrases)


_D = lexicon_en.BEFORE_NAME
_INTO = rf"(?:(?:in|into|on|onto|inside|to|over to) (?:it|there|here)\b|there\b|in here\b|(?:in|into|on|onto|inside|on top of|to) {_D}{_Y})"
_GRAB = r"(?:grab|attempt|try|reach|lunge|go|shot|swipe|stab)"
_FAILS = r"(?:failed|didn't (?:work|succeed|budge)|did not (?:work|succeed)|came to nothing|got me nowhere|fell flat|was (?:no use|in vain|useless|unsuccessful|a failure)|went nowhere|missed|(?:couldn't|wouldn't) (?:budge|be moved|come|be picked up|be opened|open|close))"
_FIRST = r"(?:(?:at|on|with) (?:the|my) (?:very )?first|at once|straight away|right away|first time|without (?:a|any) (?:hitch|trouble|fuss|problem|effort|difficulty)|without (?:trouble|fuss|effort|difficulty)|just as easily|effortlessly)"

ENGLISH = ReasonWords(
    goes_to=_all(
        rf"{_X}(?:'s|,? (?:which |that )?(?:is|are|was|were)) (?:to be (?:put|placed|dropped|left|stored|stowed|laid)|bound|destined|headed|due|intended|meant|(?:supposed|meant|intended) to (?:go|be put|be placed|end up|land|be left|be stored|wind up|finish up|be)) {_INTO}",
        rf"{_X}(?:'s|,? (?:which |that )?(?:is|are|was|were)) (?:bound|destined|headed|due|intended|meant) for {_D}{_Y}",
        rf"\b(?:because|since|as|so that|in order to|so as to|for|the reason)\b[^.;§]{{0,40}}\b(?:put|place|drop|store|leave|set|lay|stow|deliver|bring|carry|take) {_D}{_X} {_INTO}",
        rf"{_X},? (?:which |that )?(?:is|are|was|were) (?:supposed|meant|intended) to (?:go|be put|be placed|end up|land) {_INTO}",
        rf"{_X} (?:goes|has to (?:go|be put|be placed|end up)|have to (?:go|be put|end up)|needs? to (?:go|be put|be placed|end up)|must (?:go|be put|be placed|end up)|(?:is|are) wanted|(?:is|are) to (?:go|be put|be placed|end up)) {_INTO}",
        rf"\b(?:because|since|as)\b[^.]{{0,20}}{_X} belongs? {_INTO}",
        rf"\b(?:in order to|so as to|so that i can|so i can|because i (?:have to|need to|must|am to|'m to|want to)) (?:put|place|drop|store|leave|set|lay|stow) {_D}{_X} {_INTO}",
        rf"{_Y},? (?:because |since |as )?(?:that's|that is|is|it's|it is|being) (?:the place |the spot )?(?:where )?{_D}{_X} (?:goes|belongs|has to go|needs to go|(?:is|was|are|were) (?:meant|supposed) to (?:go|end up|be))",
        rf"\b(?:because|since|as) (?:that's|that is|it's|it is) (?:the place |the spot )?(?:where )?{_D}{_X} (?:goes|belongs|has to go|needs to go|(?:is|was|are|were) (?:meant|supposed) to (?:go|end up|be))",
    ),
    reason=re.compile(r"\b(?:because|since|as|in order to|so as to|so that)\b"),
    missing=_all(
        rf"\b(?:lost|mislaid|given up on(?: finding)?|still (?:looking|searching|hunting) for|(?:not|n't|never)(?: yet| even| actually)* found|yet to find|(?:can't|cannot) find) {_D}{_X}(?! (?:in|on|at|there|useful|interesting|and|or|door|lid))",
        rf"{_X} (?:is|remains) (?:nowhere|still missing|lost|missing|yet to be found|still to be found|still unaccounted)",
    ),
    dropped=_all(
        rf"\bi (?:'ve |have |had |must have )?(?:dropped|let go of) {_D}{_X}(?! (?:in|on|into|onto|off|at|down|from my))",
        rf"{_X} (?:[^.,]{{0,20}} )?(?:slipped|fell|fallen|dropped)(?: right| straight)? (?:out of|from) my (?:hand|grip|fingers)",
    ),
    all_well=re.compile(
        r"\b(?:everything|all) (?:(?:that )?i(?:'ve| have)? (?:so far )?(?:tried|done|did|attempted|reached for)|so far)(?: so far)?(?: has| have)? (?:worked|succeeded|went (?:well|fine|smoothly)|gone (?:well|smoothly|fine|to plan)|come (?:off|to hand)|came (?:off|to hand))\b"
        r"|\b(?:no (?:action|attempt|step|try|move)|none of my (?:actions|attempts|steps|tries|moves)|not (?:one|a single)(?: one)? (?:of my )?(?:actions?|attempts?|steps?|tries|moves?)) (?:of mine )?(?:has |have |had )?(?:so far |yet |ever )?(?:failed|gone wrong|misfired|been refused|been rejected)"
        r"|\b(?:whatever|everything|anything|every single thing|all (?:that )?)(?: that)? ?i(?:'ve| have)? (?:tried|reached for|went for|attempted|wanted|grabbed at|set out|asked for|put my hand)[^.;?]{0,30}\b(?:i(?:'ve| have)? (?:took|got|taken|picked|grabbed|had|managed|succeeded|done)|came|worked|succeeded|went|was mine|has worked|gave in|obliged)"
        r"|\b(?:every|each)(?: single| one of my)? (?:attempt|try|tries|grab|action|step|move|reach|pickup|command|order)s?\b[^.;?]{0,30}\b(?:worked|succeeded|success|came off|paid off|hit|landed|went (?:well|fine|smoothly|through)|gone (?:well|through)|did what|been obeyed|was obeyed|done)"
        r"|\b(?:not|never|n't)(?: once| yet| ever| a single time)* (?:failed|missed|slipped|been refused|been turned down|come up empty|been denied|fumbled)(?: (?:once|yet|so far|at all|a single time))?(?=$|[,.;!])"
        r"|\b(?:isn't|not|hardly) (?:as though|as if) anything (?:had|has) gone wrong|\bnothing (?:had|has|'s)? ?(?:ever )?gone wrong|\b(?:hasn't|haven't) been a (?:single )?(?:failure|slip|refusal|hitch|miss)\b|\b(?:a|an) (?:clean|perfect|spotless|flawless|unbroken) (?:record|run|streak|sheet|series)|\bno (?:failures?|refusals?|slips?|misses|mishaps?|setbacks?|hitch(?:es)?)(?: at all| so far| yet| whatsoever| to report| until now| on my record)(?=$|[,.;!])"
        r"|\bnothing(?: i(?:'ve| have)? (?:tried|done|did))? (?:has |have )?(?:so far |yet |ever )?(?:failed|gone wrong|been refused)\b|\bnothing has so far (?:failed|gone wrong)"
        r"|\bi(?:'ve| have) (?:not|never|yet to)(?: once| so far| yet)? (?:failed|fail)(?! to)\b|\bwithout (?:ever |once |a single )?(?:failing|failure|misstep|refusal)\b"
    ),
    except_one=re.compile(
        r"\b(?:except|aside|apart|besides|other than|save|but for|bar|since then|after that|from then|lately|just now|nearly|almost|much)\b"
    ),
    easily=_all(
        rf"{_X} came (?:along|away|off|up|to hand)\b[^.,]{{0,40}}(?:{_FIRST}|when i (?:grabbed|reached|took))",
        rf"{_X} (?:went (?:straight )?into|was in|were in|landed in) my (?:hand|grip) {_FIRST}",
        rf"{_X} (?:was|were) (?:mine|picked up|taken|grabbed|easily (?:taken|grabbed|picked up)|easy(?: enough)? to (?:get|grab|take|pick up|get hold of))(?: {_FIRST})?(?=$|[.,;])",
        rf"{_X},? (?:was |were )?(?:picked up|taken|grabbed) {_FIRST}",
        rf"\b(?:my|the) (?:very )?first {_GRAB} (?:at|for) {_D}{_X} (?:came off|worked|succeeded|paid off|went (?:through|well|fine)|did it|did the trick)",
        rf"\bi (?:had|got|have|picked up|took|grabbed|secured|obtained) {_D}{_X} (?:[^.,§]{{0,30}})?(?:{_FIRST})",
        rf"\bi (?:had|got|picked up|took|grabbed|secured) {_D}{_X} without (?:ever |once )?failing",
    ),
    failed_with=_all(
        rf"\b(?:my|the) (?:[a-z]+ )?{_GRAB} (?:at|for|on|with) {_D}{_X} [^.,§]{{0,20}}?{_FAILS}",
        rf"\bi (?:did try|tried)(?: to [a-z ]{{2,20}}| at| for)? {_D}{_X}[^.,§]{{0,25}}(?:,? (?:and|but) )(?:it |they )?(?:[a-z]+ )?{_FAILS}",
        rf"\bi (?:did try|tried) (?:to [a-z ]{{2,20}}|for) {_D}{_X} (?:in vain|without (?:any )?(?:success|luck))",
        rf"{_X} (?:{_FAILS.replace('missed|', '').replace('failed|', '')}) when i (?:tried|grabbed|reached|pulled)",
    ),
    did_fail=re.compile(
        r"\b(?:was|were|got|been) (?:refused|rejected|turned down|denied|declined|disallowed|unsuccessful|in vain)\b|\b(?:failed|didn't work|did not work|didn't succeed|did not succeed|didn't go through|came to nothing|went wrong|fell through|misfired|fell flat|backfired|didn't come off|flopped)\b"
    ),
    fails_not=re.compile(r"\b(?:not|never|nobody|no|none|nothing|n't (?:refused|fail)|nearly|almost|without|if|might|may|would|could|will|until|before|to see|because|reason|once|again)\b"),
    untouched=_all(
        rf"\b(?:i|we)(?:'ve| have|'d)?(?: (?:never|not|yet to|did not|didn't|n't))+(?: (?:yet|once|even|ever|so far|so much as))* (?:touched?|laid (?:a )?(?:hand|finger) on|lay (?:a )?(?:hand|finger) on) {_D}{_X}(?=$|[.,;]| (?:so far|yet|at all|in all))",
        rf"\bhaven't(?: (?:yet|once|even|ever|so far|so much as))* (?:touched|laid (?:a )?(?:hand|finger) on) {_D}{_X}(?=$|[.,;]| (?:so far|yet|at all|in all))",
    ),
    not_next={
        "close": _all(
            rf"{_X} (?:can|may|might as well|will|is going to) (?:stay|remain|be left) open\b",
            rf"{_X} (?:stays|remains) open(?=$|[.,;])",
            rf"\b(?:i'll leave|i will leave|i'm leaving|let me leave) {_D}{_X} (?:wide )?open\b",
        ),
        "": _all(
            rf"\bnever mind {_D}{_X}(?=$|[.,;])",
            rf"^(?:so |well |no, )?not {_D}{_X}(?=$|[.,;]|,? but )",
            rf"\bi(?:'ll| will) (?:leave|skip|ignore|forget about) {_D}{_X}(?: alone| be| as it is| for now)?(?=$|[.,;])",
            rf"\bi(?: won't|'m not going to| am not going to| will not) (?:open|close|shut|touch|take|pick up|visit|go to) {_D}{_X}(?=$|[.,;]| now| yet| after all)",
        ),
    },
    own_words=_all(
        rf"\bas i (?:said|thought|suspected|guessed|assumed|expected|figured|predicted|told myself|reasoned|noted|decided|planned)(?: (?:before|earlier|already|a moment ago|a while ago|at the start|from the start))?,? [^.§]{{0,40}}{_X}",
        rf"\bi (?:had |'d |'ve |have )?(?:already |earlier )?(?:said|thought|suspected|guessed|assumed|figured|predicted|told myself|reasoned|argued)(?: (?:before|earlier|already|from the start|all along|at the start))+,? [^.§]{{0,40}}{_X}",
        rf"\bmy (?:earlier|first|previous|original|initial) (?:guess|idea|hunch|suspicion|bet|plan|thought|theory|choice) (?:was|had been) [^.§]{{0,30}}{_X}",
    ),
    never_thought=_all(
        rf"\bi (?:have |had |'ve |'d )?never (?:even |once |seriously )?(?:thought of|considered|suspected|mentioned|suggested|guessed|thought about) {_D}{_X}(?=$|[.,;]| (?:before|until now|so far|as))",
        rf"\b(?:hadn't|haven't|did not|didn't)(?: even| once)? (?:thought of|considered|suspected|mentioned|thought about|think of|consider|suspect|mention|think about) {_D}{_X}(?=$|[.,;]| (?:before|until now|so far|as|at all))",
    ),
)  # fmt: skip
"""English."""

_Z = lexicon_zh.BEFORE_NAME
_PUTS = r"(?:放|收|送|搁|丢|扔|装|摆|塞|拿)"
_THERE = rf"(?:(?:进|到|回|入|在|上)(?:去|来|里面|里头|这里|那里|这儿|那儿|它里)|(?:进|到|回|入|在){_Z}{_Y})"

CHINESE = ReasonWords(
    goes_to=_all(
        rf"(?:为了|是要|因为要|因为得|因为我要|好)(?:把|将){_Z}{_X}{_PUTS}{_THERE}",
        rf"(?:因为|原因是)[^，。§]{{0,4}}{_X}(?:是)?(?:要|得|该|应该|必须|需要|本来要)(?:被)?{_PUTS}{_THERE}",
        rf"{_X}(?:是)?(?:要|得|该|应该|必须|需要)(?:被)?{_PUTS}{_THERE}[^，。]{{0,6}}，?所以",
        rf"(?:因为|是因为|为的是|为了|好|以便|目的是|图的是|毕竟)(?:我)?(?:待会儿|等会儿|一会儿|之后|接下来|还|就|要|得|必须|需要|应该|是|再|能|可以)*(?:把|将){_Z}{_X}(?:给)?{_PUTS}{_THERE}",
        rf"为了{_PUTS}{_Z}{_X}(?=$|[，。])",
    ),
    reason=re.compile(r"因为|由于|为了|之所以|所以"),
    missing=_all(
        rf"(?:还|一直|始终|到现在|至今)+(?:没|没有|未|没能)(?:有)?找(?:到|着){_Z}{_X}(?=$|[，。])",
        rf"找不(?:到|着){_Z}{_X}(?=$|[，。])",
        rf"{_X}(?:还|一直|始终|到现在|至今|仍|仍然)+(?:没|没有|未|没能)(?:有)?找(?:到|着)",
        rf"{_X}(?:被我)?(?:弄)?(?:丢|不见|不知去向)(?:了)?(?=$|[，。])",
    ),
    dropped=_all(rf"{_X}[^，。§]{{0,6}}(?:掉到|掉在|掉下|滑落|滑掉|摔到|摔在|落到|脱手)"),
    all_well=re.compile(
        r"(?:凡是|只要是|但凡)?我?(?:伸手|想|要|试着)?(?:拿|碰|抓|够|试|做)(?:过)?的[^，。]{0,4}(?:没有?(?:一样|一次|一个|哪样|哪次)(?:落空|失手|失败|拿不到|没成)|样样(?:都)?(?:到手|成|拿到|顺利)|(?:全|都|统统)(?:都)?(?:到手|拿到了|成了|成功))|(?:每(?:一)?(?:次|回|趟|样|件))[^，。]{0,6}(?:都|全)(?:拿到|到手|成功|成了|顺利|没(?:有)?(?:落空|失手|失败))|(?:没有?|从没|从未)[^，。§]{0,3}(?:一次|一回|哪次|任何一次)(?:落空|失手|失败|抓空|扑空)|(?:一次|一回)都没(?:有)?(?:落空|失手|失败|抓空|扑空)|百发百中|弹无虚发|无一失手|无一落空|一次没失手"
        r"|(?:每一步|步步|所有(?:的)?(?:动作|步骤|尝试)|每个动作|每次(?:动作|尝试)?|全程|一路|一切)(?:到目前为止|至今|目前|都|也|很|挺|全|均)*(?:成功|顺利|没(?:有)?(?:失败|失手|出错))"
        r"|(?:从来|从|至今|到现在|一直|还)?(?:没有?|从没|从未|未曾)(?:一次)?(?:失败|失手|出过(?:什么|任何)?(?:差错|错|问题|岔子|岔))过?(?!的)|没有(?:哪|任何|过)?(?:一)?(?:步|次|回|个动作)(?:失手|失败|出错)|一次(?:都|也)没(?:有)?(?:失败|失手|出错)|(?<!§)(?<!§也)都没出(?:过)?(?:岔子|差错|问题)"
    ),
    except_one=re.compile(r"除|此外|后来|之后|此后|除外|只有|差点|几乎|刚才这|只是"),
    easily=_all(
        rf"{_X}(?:我)?(?:刚才|之前|先前|当时|被我|也|都|早就|一开始|开头|就)*一(?:伸手|拿|次|下子?|抓|把)就?(?:拿到|到手|拿起|抓到|拿起来|成功)",
        rf"(?:拿|取|捡){_Z}{_X}(?:的)?(?:那一下|那次|那回|那会儿|时候|时|也|都|就|很|挺|倒)*(?:很|挺|都|也|十分|相当)?(?:顺利|轻松|容易|没费|一次成功)",
        rf"{_X}(?:我)?(?:之前|刚才|先前|也|都|早就|一开始|倒)*(?:很)?(?:顺利|轻松|容易|成功)(?:地)?(?:就)?(?:拿|取|捡|抓)(?:到|起|过|了)",
        rf"(?:顺利|轻松|成功)(?:地)?(?:拿到|拿起|取到|捡起)(?:过|了){_Z}{_X}",
    ),
    failed_with=_all(
        rf"(?:拿|取|捡|抓|打开|拉开|关上|关|合上|拧|按|放){_Z}{_X}(?:的)?(?:时候|时|那次|那回|那一下)?，?(?:我)?(?:却|可|但|就|都|也)*(?:失败了|没成功|没成(?=$|[，。])|没能成功|不成功)",
    ),
    did_fail=re.compile(r"没(?:有|能)?(?:成功|成(?!了)|拿成|放成|关成|开成|办成)|失败(?:了|过)|被拒(?:绝)?(?:了|过)?|落了?空|扑了?空|没拿起来|没打开来|没放进去|没放成|出了岔子|告吹|砸了|失了手"),
    fails_not=re.compile(r"不是|没有失败|没失败|没被拒|差点|几乎|如果|要是|可能|会(?!儿)|怕|别|除|因为|原因|为什么|次"),
    untouched=_all(
        rf"{_X}(?:我)?(?:到现在|至今|目前|从头到尾|压根|根本|一直|从来|一次|一下|还|连)*(?:碰|动|摸)?(?:都|也)?(?:还)?没(?:有)?(?:碰|摸)过?(?=$|[，。])",
    ),
    not_next={
        "close": _all(rf"{_X}(?:就)?(?:这么|先|让它|一直)+(?:开着|敞着)(?:吧|好了|算了)?(?=$|[，。])"),
        "": _all(
            rf"{_X}(?:我)?(?:就|先|也|暂时|还是)*不(?:开|关|看|去|拿|翻|查|打开|关上|找|碰|管)了",
            rf"(?:先|暂时|还是)不(?:开|关|看|去|拿|翻|查|打开|关上|碰){_Z}{_X}(?=$|[，。])",
        ),
    },
    own_words=_all(
        rf"(?:正如|就像|像)我(?:之前|先前|刚才|早先|前面)?(?:说|想|猜|料|提到|估计)(?:的|过的)?(?:那样|一样)?[^。§]{{0,12}}{_X}",
        rf"我(?:之前|先前|早先|前面|一开始|早就)(?:就)?(?:说|想|猜|怀疑|提到|提|估计|认为)(?:过|是|的是|到)?[^。§]{{0,12}}{_X}",
    ),
    never_thought=_all(
        rf"(?:从没|从未|从来没|从来没有|没)(?:有)?(?:想到|想过|考虑|怀疑|提到|提)过{_Z}{_X}",
        rf"{_X}我(?:从没|从未|从来没|从来没有|没)(?:有)?(?:想到|想|考虑|怀疑|提)过",
    ),
)  # fmt: skip
"""Chinese."""

REASONS: Mapping[Language, ReasonWords] = {"en": ENGLISH, "zh": CHINESE}
