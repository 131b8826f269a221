"""The critic's English phrases."""

from __future__ import annotations

import re

from er_gym.data.phrases import MARK, Phrase, Phrases


def _any(*phrases: str) -> Phrase:
    return re.compile("|".join(phrases))


def _word(words: str) -> str:
    """Any of some words or phrases, separated by ``/``."""
    return rf"\b(?:{words.replace('/', '|')})\b"


_NO = (
    "no|not|nor|on|in|to|of|for|with|from|and|or|but|at|by|near|about|into|onto|than|as|if|is|are"
    "|i|we|it|there|see|has|have|had|which|can|will|was|were|i'm|i've|i'll|then|so|stands|lies|sits|left|right"
)
_D = rf"(?:(?!(?:{_NO}) )[a-z0-9'’-]+ ){{0,4}}"
"""Articles and adjectives before a name."""
_JOINT = r"(?:,? and,? |,? n?or |, |,? as well as |,? together with |,? along with | & |/)"
_XS = rf"(?P<xs>{MARK}(?:{_JOINT}{_D}{MARK})*)"
_X, _Y = f"(?P<x>{MARK})", f"(?P<y>{MARK})"
_ON = r"(?:right |just )?(?:on top of|on|in|inside of|inside|atop|upon|within)"
_HOW = (
    "now|right|just|still|already|currently|clearly|actually|safely|there|also|both|all|here|simply"
    "|always|somewhere|out|over|up|only|finally|indeed|definitely|certainly|surely|again|really"
)
_LIES = (
    "is|are|was|were|has been|have been|had been|being|sits?|sitting|lies|lying|rests?|resting"
    "|stands?|standing|hangs?|hanging|hides?|hidden|hiding|waits?|waiting|stored|kept|placed"
    "|located|found|positioned|put away|put|left|tucked|perched|seated|set|placed"
)
_WHERE = (
    "on top of|on|in|inside|under|underneath|behind|next to|beside|near|at|by|within|atop|against"
    "|between|among|upon|above|below|in front of"
)
_I = r"\b(?:i|we)(?:'ve| have|'d| had)?(?: already| just| now| also| then| first| previously| finally| only| even| once| thoroughly| carefully)* "
_PAST = rf"(?:{_I}|\bhaving (?:already |just )?)"
_SEARCHED = (
    "searched|checked|examined|inspected|explored|investigated|looked (?:in|into|inside|through)"
    "|gone through|been through|peeked into|ruled out after"
)
_STATE = (
    r"(?: now| already| still| currently| clearly| just| standing| fully| wide| slightly"
    r"| completely| left| been| both| all| again| indeed| definitely| actually| halfway)*"
    r" (?P<no>not (?:yet |actually )?|no longer )?"
    r"(?:(?:switched|turned|powered|toggled|swung|pulled) )?"
    r"(?:(?P<open>opened|open|ajar)|(?P<closed>closed|shut|unopened)"
    r"|(?P<on>on(?= *(?:$|[.,;!?)]|and\b|now\b|already\b|again\b|at the m|at p|at this|too\b|as\b|so\b|right\b))"
    r"|lit|running|glowing|burning)|(?P<off>off(?! (?:to|the|my|in|a)\b)|unlit))\b(?! by\b| up\b|-)"
)
_IS = (
    r"(?:is|are|'s|stays?|remains?|stands?|sits?|was left|has been left|have been left|has been"
    r"|have been|appears|looks)"
)
_GO = "off/on my way/headed/going/heading/walking/moving/running/go/head/walk/move/navigate/travel/make my way/get/proceed/return/come/hurry/step"
_BEFORE_ACT = (
    r"(?: (?:now|first|next|then|just|simply|quickly|therefore|also|at once|immediately|directly"
    r"|try to|try and|go ahead and|start by|begin by|turn to|carefully|to|be|right away|instead"
    r"|rather|go and|go back and|go over and|head over and|walk over and))*,? "
)
_AND_SO = rf"{_D}{_X}"


def _act(words: str, rest: str = _AND_SO) -> Phrase:
    return re.compile(rf"(?:{words.replace('/', '|')})\b {rest}")


PHRASES = Phrases(
    sentence=re.compile(r"(?<=[.!?])[\"')]*\s+|\n+|;\s"),
    clause=_any(
        r",\s+(?!which (?:is|are|sits|stands|lies|rests|i have|i've|i already)\b)(?:(?:and|but|so|which|while|yet|then|though|although|because|since|where|as)\s+)?",
        r":\s+",
        r"\s+[—–-]\s+|—",
        r"\s(?:but|while|because|since|although|though|so that|so(?! (?:close|near|far|much|many|few|high|low|long|[a-z]+ly)\b)|whereas|yet|then)\s",
        r"\s(?:and|or)\s(?=(?:i|there|it|they|my|let|this|that|then|next)\b)",
        r"\s(?=that (?:i|we) (?:can|could|may|might|would|should|will|need|want|have to)\b)",
        r"\swhich\s(?=(?:may|might|could|would|means|tells|gives|should|must)\b)",
    ),
    verb=re.compile(
        r"\b(?:i|we|is|are|was|were|see|there(?! on (?:my|the)\b)|has|have|had|can|could|will|would|should|may|might"
        r"|must|let|stands?|sits?|lies|rests?|hangs?|holds?|contains?|shows?|seems?|appears?|looks?"
        r"|needs?|isn't|aren't|don't|doesn't|catches|makes|remains?|comes|waits?|did|does|do|put"
        r"|go|open|close|take|turn|tells?|means|happens|turns|gives)\b|'s |'m |'ve |'ll |'re |n't "
    ),
    aside=re.compile(rf", (?:if (?:i (?:recall|remember)|memory serves)|as i (?:recall|remember)|by the way|of course|in fact|funnily enough|oddly enough|incidentally|as it happens|to be (?:sure|fair|honest)|for (?:some|whatever) reason|mind you|after all|i admit|i'm (?:glad|happy|sorry) to say)[^,.{MARK}]{{0,24}},(?= )|, (?:which|who|that) [^,.{MARK}]{{0,60}},(?= (?:is|are|was|stands?|sits?|lies|rests?|hangs?|has|holds?)\b)"),
    question=re.compile(r"\?[\"')]*\s*$"),
    asking=re.compile(
        r"^(?:and |but |so |now |or |then |well |oh |ah |,| )*(?:who|what|which|where|why|how|when|whose|whom|is|are|am|was|were|do|does|did|has|have|had|can|could|would|will|shall|should|may|might|must|isn't|aren't|wasn't|don't|doesn't|didn't|haven't|hasn't|can't|couldn't|won't|wouldn't|shouldn't|any|anything|anyone|or|not|no|perhaps|maybe|if|suppose)\b"
    ),
    hedge=_any(
        _word(
            "may/might/could(?! not)/perhaps/maybe/possibly/probably/likely/likeliest/likelier/presumably"
            "/potentially/possible/plausible/plausibly/conceivably/suppose/guess/assume/suspect"
            "/whatever/let there be/let it be/supposedly/reportedly/allegedly/said to be/expect/expected/imagine/wonder/wondering/hoped/had hoped/(?<!a )(?<!no )thought/can picture/i picture/picturing/chance/chances/hope/hoping/hopefully/bet"
            "/should be/must be/must have/should have/ought to/seems/seem/appears to be/as if/as though"
            "/supposedly/apparently/unclear/unsure/not sure/uncertain/cannot tell/can't tell"
            "/(?:could|would|might|should|need|must)(?:n't| not)? have/would/i think/i believe/i'd(?! (?:[a-z]+ed|gone|been|taken|seen|put|shut|left|had|got|come|found|already|just|even)\b)/or/either/no idea/unless"
            "/whether/reckon/apt/doubt/odds/likelihood/looks like/look like/resembles"
        ),
    ),
    negation=_any(
        r"\b(?:no|not(?! (?:far|only|just|long|too|very)\b)|never|none|neither|nor|nothing(?! but\b)|nowhere|without|cannot|missing|absent|lacks?"
        r"|instead of|rather than|no sign|yet to|fails?|failed|still need|empty of|free of)\b"
        r"|n't\b|n’t\b"
    ),
    condition=_any(
        r"\b(?:if(?! (?:i (?:remember|recall)|memory serves|i'm not mistaken|i am not mistaken)\b)|unless|in case|(?<!at )once(?! (?:before|already|more|again)\b|[,.;]|$)|until|as soon as|otherwise|before(?= [a-z])(?! (?:and|but|anything|everything|me|that|this|now|us|long)\b| (?:i|we) (?:[a-z]+ed|left|went|took|came|got|had|ever|even|put|shut|set|saw|found|made|ran|stood|gave|held|brought)\b| i'd\b)|provided|suppose|assuming"
        r"|even when|whenever|wherever|would have|in order to|so as to)\b|\bwhen (?!i (?:last |first |finally |just |only )?(?:[a-z]+ed|was|stood|saw|went|got|came|took|had|put|shut|set|left|found|ran|made)\b)"
    ),
    goal=_any(
        r"\b(?:need(?:s|ed)?|have to|has to|look(?:ing)? for|search(?:ing|es|ed)? for|search of|hunt(?:ing)?"
        r"|to find|find the|locate|locating|asked|task|job|mission|instructions?|instructed|goal"
        r"|supposed to|want(?:s|ed)?|wanted|after|aim|target|requires?|required|request(?:ed)?|objective"
        r"|belongs?|destination|counts|matters|deal with|eye out|seek(?:ing)?|in quest of|bring|deliver"
        r"|should|must|to get|to take|to pick|to put|to place|to open|to check|to reach|to look)\b"
    ),
    custom=_any(
        r"\b(?:usually|often|typically|normally|commonly|generally|tend(?:s)? to|people|someone who"
        r"|such as|things like|like an?|a place for|places? where|spots? for|spot where|kind of|sort of place"
        r"|natural|in general|in most|most (?:homes|kitchens|bathrooms|bedrooms|households)|kitchens"
        r"|households|homes|frowned upon|common(?:ly)?|frequently|sometimes|regularly|as a rule|ordinarily|one would|worth"
        r"|makes sense|logical|reasonable|makes? (?:a|it) good|is where (?:people|one|you)|are (?:usually )?(?:kept|stored))\b"
    ),
    past=re.compile(
        r"\b(?:was|were|had|earlier|before(?! (?:me|us)\b)|previously|remember|recall|at the start|from the start"
        r"|at first|used to|initially|a moment ago)\b"
    ),
    intention=_any(
        r"\b(?:will|shall|let me|let's|let us|going to|about to|plan(?:s|ned|ning)?|intend|decided?|next(?! to\b)"
        r"|want to|had better|i'd better|time to|heading|consider|option|options|could|ready to|try|bring|carry"
        r"|(?:am|'m) (?:taking|bringing|carrying .* to))\b|'ll\b|^to (?!(?:one|my|the|either)\b)|^by (?!(?:my|the)\b)"
    ),
    supposition=_any(
        r"\b(?:if(?! (?:i (?:remember|recall)|memory|i'm not mistaken)\b)|unless|in case|suppos(?:e|ing)|assuming|provided|imagine|as though|i wish)\b",
        rf"^(?:and |but |so |well |then )*(?:had|were|should) (?:i|we|it|they|there|anyone|somebody|someone|this|that|(?:the|a|an|my|any|one) (?:[a-z-]+ ){{0,2}}{MARK}|the|my)\b",
    ),
    coming=re.compile(
        rf"\b(?:after|once|when|as soon as|by the time) (?:i have|i've|i am|i'm|it's|it is|it has|that's|that is|(?:the|my|both|all) [^,]{{0,20}}{MARK} (?:is|are|has|have)\b)[^.]*(?:\bwill\b|'ll\b|\bcan\b|\bgoing to\b)"
        rf"|(?:\bwill\b|'ll\b|\bcan\b)[^.]*\b(?:after|once|when|as soon as) (?:i have|i've|i am|i'm|(?:the|my|both|all) [^,]{{0,20}}{MARK} (?:is|are|has|have)\b)"
    ),
    contrast=re.compile(r"^(?:but|yet|still|however|as it is|as it happens|luckily|fortunately|alas|unfortunately)\b"),
    contrast_after=re.compile(r"(?:\bbut|\byet|\bhowever)$"),
    seen=(
        re.compile(
            r"\b(?:see|sees|seeing|saw|spot|spotted|spots|notice|noticed|observe|observed|make out|catch sight of|caught sight of"
            r"|glimpse|glimpsed|recogni[sz]e|identify|discover|discovered|found|located|detect|looking (?:right )?at|staring at"
            r"|come across|came across|there is|there's|there are|here is|here's|here are|comes|that is|that's|this is|facing)"
            rf" (?:that |both |also |now |clearly |already |right |here )*(?!(?:where|what|why|how|when) ){_D}{_XS}(?! (?:shows|makes sense))"
        ),
        re.compile(
            rf"{_XS}(?:,? (?:is|are|has|have|lies|lie|comes|stands|sits)|'s)(?: (?:{_HOW}|come|coming|been|immediately|plainly))*"
            r" (?:visible|in (?:plain |clear |full )?(?:view|sight)|(?:right |over |just )?(?:there|here)\b|within (?:view|sight|reach)"
            r"|into (?:view|sight)|in front of me|before me|nearby|close by|close to me|straight ahead|ahead|behind me"
            r"|to (?:my|the) (?:left|right)|on (?:my|the) (?:left|right)|next to|beside|at my feet|within my)"
        ),
        re.compile(rf"{_XS} (?:catche?s?|caught|draws?|drew|stands? out|comes? into)\b"),
    ),
    located=(
        re.compile(rf"{_XS}(?:,? (?:which|that))?(?:(?: (?:{_HOW}))* (?:{_LIES})|'s)(?: (?:{_HOW}|{_LIES}))* (?:{_WHERE})\b"),
        re.compile(rf"where {_D}{_XS}(?: (?:{_HOW}))* (?:is|are|lies|sits|rests|can be found|has been|waits|hides)\b"),
    ),
    on=(
        re.compile(rf"{_XS},?(?: (?:which|that))?(?: (?:{_HOW}|{_LIES}))* {_ON} {_D}{_Y}(?! (?:in front|that i))"),
        re.compile(
            rf"\b{_ON} {_D}{_Y},?(?: (?:i|we|there|can|see|spot|notice|make|out|find|{_HOW}|{_LIES}|i'm|looking at))+ {_D}{_XS}"
            r"(?! (?:next to|beside|behind|near))"
        ),
        re.compile(
            rf"{_Y}(?: (?:{_HOW}|in front of me|which|that))*"
            rf" (?:holds?|contains?|carries|houses?|displays?|bears|hides|conceals|is holding|is home to|supports) {_D}{_XS}"
        ),
        re.compile(rf"{_Y}(?: (?:{_HOW}))* (?:has|have|with) {_D}{_XS}(?: \w+)? (?:on|in|inside|within|on top of)(?: it| them| top)?\b"),
        re.compile(rf"{_Y},?(?: (?:which is|is))? where {_D}{_XS} (?:is|are|lies|sits|rests|stands|can be found|has been|waits|hides)\b"),
    ),
    out_of=(
        re.compile(
            rf"\b(?:take|get|grab|fetch|retrieve|pick up|pull|remove|collect)(?: out)? {_D}(?P<xs>{MARK})"
            rf" (?:that is |which is )?(?:out of|from inside|from within|from|inside) {_D}{_Y}"
        ),
        re.compile(rf"{_Y},? (?:which is |is )?where {_D}(?P<xs>{MARK}) (?:is|are|lies|sits|rests|stands|waits|hides)\b"),
    ),
    placing=re.compile(
        r"\b(?:put|puts|putting|place|placing|(?<!has )(?<!been )(?<!is )(?<!was )placed|set|setting|leave|leaving|(?:i|i've|i have) left|drop|dropping|dropped|lay|laid|laying"
        r"|store|storing|stored|bring|bringing|brought|move|moved|moving|carry|carrying|carried|add|insert|inserted|look|looking"
        rf"|search|searching|searched|check|checking|checked|deposit|deposited|deliver|belongs?|want) (?!on |at |in ){_D}(?:for {_D})?(?:{MARK}{_JOINT}{_D})*$"
    ),
    sides={
        "left": _any(
            r"\b(?:on|to|at|toward|towards|off to|over to|over on) (?:my|the)(?: far| immediate| near)? left(?:[- ]hand side| side)?"
            r"(?! of (?!me\b|my\b|the (?:view|picture|image|frame|room|scene)))\b",
            r"\b(?:in|on) (?:my|the) left (?:part|half|side) of",
            r"\bleft of me\b|\bto (?:my|the) left side\b",
        ),
        "right": _any(
            r"\b(?:on|to|at|toward|towards|off to|over to|over on) (?:my|the)(?: far| immediate| near)? right(?:[- ]hand side| side)?"
            r"(?! of (?!me\b|my\b|the (?:view|picture|image|frame|room|scene)))\b",
            r"\b(?:in|on) (?:my|the) right (?:part|half|side) of",
            r"\bright of me\b|\bto (?:my|the) right side\b",
        ),
        "behind": re.compile(r"\bbehind me\b|\bbehind my back\b|\bat my back\b|\bto my rear\b|\bin back of me\b"),
        "ahead": re.compile(
            r"\b(?:straight|directly|right|dead|just) ahead\b(?: of me)?|\bahead of me\b|\b(?:directly|right|straight) in front of me\b"
            r"|\bin the (?:center|centre|middle) of (?:my|the) (?:view|picture|image|frame|field)|\bahead(?= *(?:$|[.,;]))"
        ),
    },
    nearly=re.compile(r"(?:slightly|a (?:little|bit|touch|fraction)|just|somewhat)(?: off| over)? $"),
    of_other=re.compile(
        r"\b(?:next to|besides|beside|near|by|of|for|on|in|above|under|below|underneath|over|behind|(?<!looking )at|inside|with|against|between|beyond|past|than|from|to|towards|along)"
        rf" {_D}(?:{MARK} and {_D})?$"
    ),
    is_so=re.compile(r",? (?:is|are|stands?|sits?|lies|lie|rests?|hangs?|there (?:is|are)|there's|i (?:can |could )?(?:also )?(?:see|notice|spot|find|make out|have))\b"),
    states=(
        re.compile(rf"{_X}(?:'s)?(?: doors?| lid| cover| screen)?(?: (?:in front of me|here|there|ahead|nearby))?,?(?: {_IS}|'s){_STATE}"),
        re.compile(rf"{_X},? (?:and |but )?it(?: {_IS}|'s){_STATE}"),
        re.compile(rf"{_X}, which(?: {_IS}){_STATE}"),
        re.compile(rf"\bi (?:find|found|see|notice) {_D}{_X}{_STATE}"),
        re.compile(
            r"\b(?:the|an?|this|that|its|already|still|now|currently) (?:already |still |now |half-)?(?:(?P<open>open|opened)|(?P<closed>closed|shut)|(?P<on>lit|switched-on)"
            rf"|(?P<off>unlit|switched-off)) (?:[a-z]+ )?{_X}(?P<no>)"
        ),
    ),
    it_states=re.compile(rf"^(?:and |but |as |since |because )?it(?: {_IS}|'s){_STATE}"),
    held=(
        re.compile(
            r"\b(?:i am|i'm|i|gripper is|gripper|arm is|hand is|hand|hands)(?: now| still| already| currently| finally| also)*"
            rf" (?:holding|hold|holds|carrying|carry|gripping|clutching|hanging on to)(?: on to| onto)? {_D}(?P<xs>{MARK})"
        ),
        re.compile(
            rf"\b(?:have|got|having|with) {_D}(?P<xs>{MARK})(?: (?:now|safely|firmly|securely|already|finally|still))* (?:in (?:my|the|one) (?:hands?|grip|gripper|arms?)|in hand|with me)\b"
        ),
        re.compile(
            rf"(?P<xs>{MARK})(?:,? (?:is|are|{_HOW}|firmly|securely)|'s)+ (?:in|within) (?:my|the) (?:hands?|grip|gripper|arms?|grasp|possession)\b|\bin my hand(?:s)?(?: is|,? i (?:have|hold)) {_D}{_X}"
        ),
        re.compile(rf"\bi (?:now|finally|already) have {_D}(?P<xs>{MARK})(?= *(?:$|[.!]|,? (?:so|and (?:i|can|my))\b))"),
    ),
    not_held=(
        re.compile(
            rf"(?:\bnot|n't|no longer)(?: yet| currently)? (?:holding|hold|carrying|carry|have) {_D}{_XS}(?= *(?:$|[.,!]|yet|now|any|in my hand))"
        ),
        re.compile(rf"{_XS} (?:is|are)(?: not|n't| no longer)(?: yet| currently)? in my (?:hands?|grip|gripper)"),
        re.compile(rf"\b(?:holding|hold|carrying|carry|have) neither {_D}{_XS}"),
        re.compile(rf"\bneither {_D}{_XS} (?:is|are)(?: yet| currently)? in my (?:hands?|grip|gripper)"),
    ),
    empty_hand=re.compile(
        r"\b(?:my|both(?: of my)?|the) (?:hands?|gripper|arms?) (?:is|are|'s)(?: now| still| currently| again| both| completely| otherwise)? (?:empty|free)\b"
        r"|(?:\bnot|n't)(?: currently| yet)? have anything in (?:my|either) hands?|\bempty[- ]handed\b|\bnothing (?:is )?(?:yet )?in (?:my|the|either) hands?\b|(?:\bnot|n't)(?: currently| yet)? (?:holding|carrying|hold|carry) anything\b"
        r"|\b(?:hold|holding|carry|carrying) nothing\b|\bwith (?:an empty|a free|empty|free) hands?\b"
    ),
    failed=_any(
        r"\b(?:last|previous|preceding) (?:action|attempt|step|move|try)[^.,]{0,40}?(?:failed|fail|unsuccessful|(?:did not|didn't|has not|hasn't) (?:succeed|work|go)|had no effect|was not|wasn't)",
        r"\b(?:failed|unable|not able|wasn't able) to (?:open|close|pick|take|grab|put|place|reach|get to|switch|turn|toggle|navigate|go|walk|head|move|shut|pull|slice|look around|step|observe|do (?:it|that|this|so))\b",
        r"\battempt to [^.,]{0,40}(?:failed|did not|didn't|was unsuccessful|had no)",
        r"\b(?:could not|couldn't) (?:open|close|shut|pick|take|grab|put|place|reach|get to|switch|turn|toggle|lift|move|navigate|go|walk|step|head|pull)\b",
        r"\b(?:the|my|that|this) (?:action|attempt|move) (?:has )?(?:failed|did not|didn't)\b",
        r"\bwent wrong\b",
    ),
    succeeded=_any(
        r"\b(?:that|it|this|which) (?:has )?(?:worked|succeeded)\b(?! before)",
        r"\b(?:last|previous|preceding) (?:action|attempt|step|move|try)[^.,]{0,30}?(?:was (?:a )?success|succeeded|worked|went through|went (?:well|exactly|through|as|smoothly)|has succeeded|did its)",
        r"\b(?:i )?(?:managed|was able|have been able) to (?:open|close|pick|take|grab|put|place|reach|get to|switch|turn|toggle|navigate|go|walk|move|shut|look around|step)\b",
        r"\bwent (?:exactly )?as (?:planned|expected|intended)\b|\bi (?:have )?successfully\b|\bworked as (?:planned|expected)\b",
    ),
    failing=re.compile(
        r"\b(?:fail|failed|fails|failure|unsuccessful|did not|didn't|not (?:work|succeed|go|budge|respond)|went wrong|could not|couldn't|unable|no effect|again|retry|once more|repeat|wrong|slipped|refused|did nothing|nothing happened|instead)\b"
    ),
    decides=_any(
        r"\b(?:i|we)(?: will|'ll| shall| am going to(?! (?:the|a|an|my|that|this|one|§))| am about to| decide to| have decided to| choose to| intend to| plan to| am now going to| should| must| need to| have to| had better| want to| ought to| am ready to| would rather)\b",
        r"\bi'(?:ll|m going to(?! (?:the|a|an|my|that|this|one|§))|m about to|ve decided to|d better|d rather)\b",
        r"\bmade up my mind to\b|\blet me\b|\blet's\b|\blet us\b|\btime to\b|\bready to\b",
        r"\b(?:next|best|right|obvious|logical|sensible|first|immediate|remaining|only) (?:step|move|thing|action|option|choice|place|idea|course)[^.,§]{0,40}? (?:is|will be)(?: now)?(?: to)?\b",
        r"\bmakes? (?:the most |more |good |perfect )?sense to\b|\bmy (?:plan|decision|choice) is(?: now)? to\b|\bdecision is to\b|\bdecided(?: to|:)",
        r"\b(?:is|are) (?:what|where|the one) i(?:'ll| will|'m going to)(?= (?:open|go|take|head|close|pick|visit|try|check) )",
        r"\b(?:so|now|therefore|thus|hence|next|then|accordingly),? i(?= )",
        r"\b(?:this (?:very )?(?:moment|minute|instant)|before anything else),? i(?:'ll)?(?= )",
        r"\bi'm(?= (?:now )?(?:off|on my way|headed) to\b)|^(?:and |so |now |but )*(?=off to )",
        r"\bi(?:'m| am)(?: now| just| simply| therefore)?(?= (?:swinging|sliding|pressing|flipping|flicking|grasping|lifting|collecting|bringing|carrying|stepping|returning|checking|searching|looking around|ending|stopping|finishing|laying|leaving (?:it|the §|§)|going|heading|walking|moving|running|opening|pulling|closing|shutting|picking|grabbing|taking|fetching|putting|placing|dropping|setting|switching|turning)\b)",
        r"\b(?:this (?:very )?(?:moment|second|instant)|right now|without delay|at once|here and now|before anything else|first of all|from here|straight away),? i(?:'m|'ll| am| will)?(?= )",
        r"\bi(?: now| hereby)? (?:declare|consider|count|call) [^,.;]{0,30}\b(?:and|,)(?= (?:end|stop|finish|leave|call))",
        r"(?:^|: )(?:and |so |now |then |next |but |well |right )*(?=(?:off|over|on|back|across|straight|up) (?:over |on |back |straight )?to (?:the|that|this|my) )",
        r"(?:^|: )(?:and |so |now |then |well |right )*(?=to the (?:[a-z]+ )?§(?:,? (?:then|now|next|i go)\b|[.!]|$))",
        r"^i(?= (?:now |therefore |simply |then )?(?:take|press|flip|end|stop|finish|swing|slide|pull|step|look around|go|head|walk|open|close|shut|pick|take|grab|place|switch|toggle|navigate|return|approach)\b)",
    ),
    before_act=re.compile(_BEFORE_ACT),
    weak=re.compile(r"\b(?:should|must|need to|have to|want to|ought to|ready to)$"),
    acts={
        "forward": re.compile(r"(?:move|step|go|take|walk|come|get|edge|inch)(?: (?:a|one|little|bit|small|step|slightly|just|few|steps|half))* (?:forward|closer|nearer|ahead)\b|take (?:a|one)(?: small| little| single)? step"),
        "look around": re.compile(
            r"(?:stop and )?(?:observe\b(?! (?:the|that|how|what) §)|(?:look|glance|take a (?:good |quick |full )?look|have a look|turn)(?: all)? (?:around|about|round)\b(?! §)|(?:scan|observe|survey|view)(?: the| my| this)?(?: whole| entire| rest of the)? (?:room|surroundings|area|kitchen|bathroom|bedroom|living room|scene))"
        ),
        "go": _act(_GO + "/to/over/on/back/across/straight/up", rf"(?:(?:(?:back|over|straight|right|directly|on|up|across|down|now|out|first|to|towards?|for|near|off|close) )+{_D}{_X}|(?:back |over |across |straight |right |up )*there\b)"),
        "visit": _act("approach/visit/try/return to/make for", _AND_SO),
        "check": _act(
            "check/search/inspect/examine/investigate/explore/look/peek/take a look/take a closer look/have a look/have a closer look/see what is/rummage",
            rf"(?:(?:in|into|inside|at|on|under|behind|through|over|closely|around|out|more|once|again|beneath|next|what|is|near|by) )*{_D}{_X}",
        ),
        "open": re.compile(rf"(?:opening|pulling open|open|open up|pull open) {_D}{_X}|(?:pulling|swinging|sliding|flinging|pull|swing|slide|fling) {_D}(?P<x2>{MARK}) open"),
        "close": re.compile(rf"(?:closing|shutting|close|shut)\b {_AND_SO}|(?:swinging|pushing|sliding|pulling|swing|push|slide|pull) {_D}(?P<x2>{MARK})(?: door| lid)? (?:shut|closed|to|back in|home)\b"),
        "put": re.compile(
            rf"(?:putting|placing|dropping|setting|put|place|set|drop|leave|lay|deposit|store|insert|bring|carry|deliver|transport) (?:it|them|this|{_D}{MARK})(?: \w+)? (?:in|into|on|onto|to|inside|on top of|over to|down on) {_D}{_X}"
            rf"|(?:taking|take) (?:it|them|this|{_D}{MARK})(?: (?:back|along|over|straight|right))* (?:into|onto|to|over to) {_D}(?P<x2>{MARK})"
        ),
        "take": _act("picking up|picking|taking out|taking|grabbing|fetching|pick up|pick|take out|take|grab|grasp|get|fetch|collect|lift|retrieve", _AND_SO),
        "toggle": re.compile(rf"(?:turning|switching|pressing|flipping|flicking|powering|lighting|turn|switch|power|toggle|flip|flick|press|activate|deactivate|light)(?: on| off| up| down)? {_D}{_X}|(?:turning|switching|turn|switch) (?:it|them) (?:on|off)\b"),
        "slice": _act("slice|cut|chop", _AND_SO),
        "end": re.compile(r"(?:ending|stopping (?:here|now)|end|finish(?! *(?:$|[.!,;]))|stop(?! and\b)|conclude|wrap up|call it)(?: the task| here| now| it| this| there| my| everything| the)?\b"),
    },
    later=re.compile(
        r"\b(?:later|afterwards?|after|eventually|finally|in the end|then|once|subsequently|at the end|lastly|next i|second|secondly|as well|also|still|come back|if need be|if necessary|only|and then|if|unless|when|until|before|otherwise|could|might|would|don't|not|no|never|rather than|instead of)\b|n't\b"
    ),
    first=re.compile(r"\b(?:first|right now|right away|immediately|at once|to begin with|to start)\b"),
    instead=re.compile(r"\b(?:instead|actually|on second thought|rather|change my mind|no,|wait)\b"),
    over=re.compile(
        r"\b(?:task|job|mission|everything|work|whole thing)(?: (?:is|has been)|'s)(?: now| finally| already| all| fully| therefore)* (?:complete|completed|done|finished|accomplished|fulfilled)\b"
        r"|\bi(?:'m| am| have)(?: all| now)? (?:done|finished)(?= *(?:$|[.,!]|with (?:the|my|this) task|here))|\bnothing (?:more|else|left|further)(?: is left| remains)? (?:for me )?to (?:do|be done)\b"
    ),
    leak=_any(
        r"\b(?:the|this|that|your|given|provided|following) hints?\b(?! of\b)|\bhints? (?:says?|tells?|states?|mentions?|suggests?|given|provided|reads?)\b|\bkey actions?\b|\bground[- ]truth\b|\bdata ?sets?\b|\blanguage model\b|\ban ai\b|\bai (?:assistant|model)\b|\bas an? (?:large |ai|assistant|model)",
        r"\b(?:as|i was|i am|i've been|have been) (?:instructed|told|asked) to (?:justify|explain|write|give|provide|produce|respond|think of)\b|\bas instructed,|\bjustify (?:the|my|this) (?:decision|action|choice)",
        r"\b(?:provided|given|supplied|predetermined|intended|predefined|prescribed|expected) (?:decision|action|answer|list|plan|sequence|next (?:step|action))\b|\b(?:decision|action|list|answer|sequence)[^.]{0,30}(?:was|were|has been|have been|am|is) given (?:to me|here)\b|\blist[^.]{0,40}\bgiven\b",
        r"\b(?:candidate|given|pending|navigable|provided|supplied|location) list\b|\bthe list (?:of|that|given|shows|contains)|\bmetadata\b|\bsimulator\b|\bsystem prompt\b|\bthe prompt\b|\bword limit\b|\btraining data\b|\bannotat(?:ion|ed|or)",
        r"\bi(?:'m| am) sorry,? (?:but )?i (?:can't|cannot|can not|am unable|won't)|\bi (?:cannot|can't|am unable to) (?:assist|help(?! (?:but\b|[a-z]+ing\b))|comply|fulfill|provide|process|view (?:the )?images)|\bcan(?:'t|not) (?:assist|help) with",
        r"\b(?:http|error|status)(?: code)?:? ?[45]\d\d\b|\b[45]\d\d (?:internal|bad|too many|service|gateway|forbidden|unauthori|not found|error)|\brate limit|\btoo many requests\b|\binternal server error\b|\btime(?:d)? ?out error\b|\btraceback\b|\bapi key\b|\bexception\b:|\bopenai\b|\bgpt-?\d|\brequest failed\b|\bconnection (?:error|refused|reset)|\binsufficient[_ ]quota|\bcontent policy\b",
    ),
    labels=re.compile(
        r"^\s*[*_#>\"']*\s*(?:assistant|user|system|human|robot|agent|ai|bot|output|response|answer|observation|thinking|thought|planning|plan|reflection|verification|decision ?making|reasoning|analysis|situation analysis|action|decision)\s*[*_]*\s*[:：]",
        re.IGNORECASE | re.MULTILINE,
    ),
    foreign=re.compile(
        r"\b(?:je|vais|dans|pièce|une|est|les|des|autour|nous|sur|pour|avec|ich|der|die|das|und|nicht|mich|wo|ein|eine|einen|ist|zu|könnte|auf|mit"
        r"|voy|los|las|una|está|por|para|que|en|del|hay|habitación|el|io|il|della|che|sono|nella|eu|vou|para|não|um|uma|em|de|la|le|um)\b"
    ),
)  # fmt: skip
"""English."""
