"""English word classes."""

from __future__ import annotations

import re

from er_gym.data.clauses.lexicon import Lexicon, Words
from er_gym.data.phrases import MARK
from er_gym.tasks import verbs

_NO = (
    "no|not|nor|on|in|to|of|for|with|from|and|or|but|at|by|near|about|into|onto|than|as|if|is|are"
    "|i|we|it|there|see|has|have|had|which|can|will|was|were|then|so|before|after|until|when|while"
    "|out|up|down|off|over|back|nothing|something|anything|everything|that|where|because|without"
)
BEFORE_NAME = _D = r"(?:that (?!i\b|is\b|the\b))?(?:(?!(?:" + _NO + r") )[a-z0-9'-]+ ){0,3}"
"""Articles and adjectives before a name."""
_OF = r"(?:the (?:lid|door|doors|inside|front|top|side) of )?"
_XS = rf"(?P<xs>{MARK}(?:(?:,? and,? |,? n?or |, |,? as well as |/){_D}{MARK})*)"
_X, _Y = f"(?P<x>{MARK})", f"(?P<y>{MARK})"
_ADVERB = (
    "already|just|now|also|then|first|previously|finally|only|even|once|thoroughly|carefully|twice"
    "|indeed|in fact|certainly|actually|successfully|easily|quickly|earlier|never|not|ever|so much as"
    "|properly|simply|somehow|promptly|duly"
)
_I = rf"\b(?:i|we)(?:'ve|'d| have| had| did manage to| managed to| was able to| was just| did)?(?: not|n't)?(?: (?:{_ADVERB}))*(?:, [^,{MARK}]{{1,40}},)?"
_DONE = rf"(?:{_I}|\bhaving(?: (?:{_ADVERB}))*|\bafter(?: (?:{_ADVERB}))*|\bonce i(?:'d| had)?(?: (?:{_ADVERB}))*|(?<=§)[^§,.]{{0,30}}(?:,| and| or|,? and then|,? then)(?: i)?(?: (?:{_ADVERB}))*)"
_WAS = rf"(?:(?:has|have|had|'s|'d)(?: (?:{_ADVERB}))* been|was|were|got)(?: (?:{_ADVERB}))*"
_BY_OTHERS = r"(?! by (?!me\b|my\b|hand))"


def _any(*phrases: str) -> Words:
    return re.compile("|".join(phrases))


def _deed(past: str, gerund: str, participle: str, *more: str) -> tuple[Words, ...]:
    """A verb with its object: done by the agent, passive, or in a relative clause."""
    return (
        re.compile(rf"(?:{_DONE}) (?:{past}|{gerund}) {_D}{_OF}{_X}"),
        re.compile(rf"{_X} (?:that |which )?(?:{_I}) (?:{past})(?=$|[,.;: ](?!{_D}{MARK}))"),
        re.compile(rf"{_X} {_WAS} (?:{participle})\b{_BY_OTHERS}"),
        *(re.compile(each) for each in more),
    )


_OPENED = (
    r"opened(?: up)?|pulled open|swung open|flung open|slid open|unlatched|yanked open|prised open"
)
_TOOK = (
    r"picked up|took(?: up| out| hold of| away)?|taken(?: up| out| away)?|grabbed(?: hold of)?|got hold of|gotten hold of|fetched|collected|retrieved|snatched(?: up)?"
    r"|scooped up|seized|gathered(?: up)?|gripped|got my hands? on|laid hold of|plucked|removed|went and (?:fetched|got|took|picked up)|moved(?= (?:the |a |that |this |my )?§(?:$|[,.;]| (?:just|too|as well|also|out of the way|aside)\b))|come away with|came away with"
)
_PUT = r"placed|dropped(?: off)?|stowed(?: away)?|laid|deposited|stored|tossed|thrown|threw|delivered|shoved|tucked|popped|moved|slipped|parked"
_SEARCHED = (
    r"searched(?: through)?|checked|examined|inspected|explored|investigated|combed(?: through)?|rummaged (?:in|through|around in)|gone (?:all )?through|went (?:all )?through|been (?:all )?through|sifted through"
    r"|(?:looked|peered|peeked|glanced|had a look|taken a look|took a look|poked around|dug around|stuck my head) (?:into|inside|through|in)|ruled out|tried|gone over|crossed off"
)
_WENT = (
    r"(?:gone|went|been|walked|moved|travelled|traveled|navigated|returned|headed|run|hurried|stepped|rolled|driven|drove|come|came|got|popped|stopped off|made a trip|made my way|made it|made a stop|paid a visit)"
    r"(?: straight| right| all the way| back)?(?: over| across| up)?(?: anywhere near| near| to(?! see)| by)|stopped (?:at|by)|visited|reached|approached|called at|paused at|set foot near|dropped by|arrived at|swung by"
)
_HAVE = (
    r"(?:\b(?:i|we)(?:'ve|'d| have| had)|\bhaving)(?: (?:already|just|now|then|finally|never|not))*"
)
_IN = r"(?:in|into|inside|on|onto|on top of|to|down on|away in|upon)"

LEXICON = Lexicon(
    deeds={
        verbs.OPEN: (
            *_deed(_OPENED, "opening|pulling open", "opened"),
            re.compile(rf"(?:{_I}|\bhaving) (?:lifted|raised|flipped up|popped) {_D}{_X}(?: lid| seat)?"),
            re.compile(rf"(?:{_I}|\bhaving) (?:pulled|swung|slid|flung|yanked|pushed|had|got) {_D}{_X} (?:wide )?open\b"),
            re.compile(rf"{_X}(?: lid| door)? {_WAS} (?:raised|lifted|pulled open|swung open)\b"),
        ),
        verbs.CLOSE: _deed(
            r"closed(?: up)?|pushed shut|slammed(?: shut)?", "closing|shutting", r"(?:properly |firmly )?(?:closed|shut) again",
            rf"(?:{_HAVE}) shut {_D}{_X}",
            rf"(?:{_I}) (?:got|pushed|pulled|slid) {_D}{_X} (?:closed|shut)",
        ),
        verbs.PICKUP: (
            *_deed(_TOOK, "picking up|taking|grabbing|fetching|collecting|retrieving", "picked up|taken|grabbed|collected|fetched|retrieved"),
            re.compile(rf"(?:{_DONE}) (?:picked|took|taken|lifted|picking|pick) {_D}{_X}(?: right)? (?:up|away|out|along|with me)\b"),
            re.compile(rf"\bi (?:'ve |have |had )?(?:just |already |even |simply )?(?:lifted|hoisted|nabbed|pocketed|bagged|secured|scooped) {_D}{_X}(?! (?:lid|seat|door))"),
            re.compile(rf"\b(?:asked|went|reached|lunged|tried|made) (?:out )?for {_D}{_X},? and (?:i )?(?:got|took|have|caught|had|grabbed) (?:it|them|hold)\b"),
            re.compile(rf"\bi (?:took|had|got|grabbed) (?:one|it|them|two|some)(?: of)? (?:the |these |those )?{_X}\b"),
            re.compile(rf"(?:{_I}) got {_D}{_X}(?=$|[.;]| (?:earlier|before|already|from|out of|off)\b)"),
            re.compile(r"\b(?:managed|was able|did manage) to (?:pick up|take|grab|get hold of|get|fetch|collect) " + _D + _X),
            re.compile(rf"\b(?:grabbing|taking|picking up|getting|fetching|lifting|collecting) (?:hold of )?{_D}{_X} (?:was (?:easy|simple|no (?:trouble|problem|effort)|effortless|a breeze|quick|straightforward|a success)|worked(?! out badly)|went (?:well|fine|smoothly|through|off)|succeeded|posed no)"),
            re.compile(rf"\bsucceeded in (?:grabbing|taking|picking up|getting|fetching|lifting|collecting) (?:hold of )?{_D}{_X}"),
            re.compile(rf"\bi did (?:pick up|take|grab|get|fetch|collect) {_D}{_X}"),
            re.compile(rf"{_X} came (?:along|away|up|off)\b[^,.]{{0,40}}(?:when|as) i (?:grabbed|took|pulled|reached|picked)"),
            re.compile(rf"\b(?:grab|attempt|try|reach|lunge) (?:at|for) {_D}{_X} (?:went|worked|succeeded|paid off|was a success|came off)(?! wrong| nowhere| out)"),
        ),
        verbs.PUT: (
            re.compile(rf"\bi (?:just |already |even )?(?:put|set) (?:it|them|{_D}{MARK})(?: back| down| away| safely| off)* {_IN} {_D}{_Y} (?:a (?:second|moment|minute|while|little while) ago|earlier|already|before|just now|at the (?:start|beginning))"),
            re.compile(rf"(?:{_HAVE}) (?:put|set|left) (?:it|them|{_D}{MARK})(?: back| down| away| safely| off)* {_IN} {_D}{_Y}"),
            re.compile(rf"(?:{_DONE}) (?:{_PUT}|putting|placing|dropping) (?:it|them|{_D}{MARK})(?: back| down| away| safely| off)* {_IN} {_D}{_Y}"),
            re.compile(rf"{MARK} (?:has|have|had|is|was)(?: (?:{_ADVERB}))* been (?:{_PUT}|put|set)(?: back| down| away| safely| off)* {_IN} {_D}{_Y}"),
        ),
        verbs.TOGGLE: (
            re.compile(rf"(?:{_DONE}) (?:switched|turned|flicked|flipped|toggled|powered|shut) (?:on|off) {_D}{_X}"),
            re.compile(rf"(?:{_DONE}) (?:switched|turned|flicked|flipped|powered|toggled) {_D}{_X}(?: back)? (?:on|off)\b"),
        ),
        verbs.NAVIGATE: (
            re.compile(rf"(?:{_DONE}) (?:{_WENT}) {_D}{_X}"),
            re.compile(rf"(?:{_DONE}) (?:visiting|going to|walking to|reaching) {_D}{_X}"),
            re.compile(rf"{_X} {_WAS} visited\b"),
        ),
        "searched": (
            *_deed(_SEARCHED, "searching|checking|inspecting|examining|going through|looking (?:in|into|inside|through)|peering into", "searched|checked|examined|inspected|explored|ruled out"),
            re.compile(rf"\b(?:my|a|the) (?:[a-z]+ )?(?:search|inspection|check|tour|sweep|survey|examination) of {_D}{_X}(?= (?:already|is over|is done|has|turned|brought|yielded|came|was|gave|earlier|before)|$|[,.;])"),
        ),
    },
    deed_words={
        verbs.OPEN: re.compile(r"open|swung|flung|slid|unlatch|lift|rais|flip|popp"),
        verbs.CLOSE: re.compile(r"clos|shut|slamm|got|push|pull|slid"),
        verbs.PICKUP: re.compile(r"pick|tak|took|grab|got|fetch|collect|retriev|snatch|scoop|seiz|gather|gripp|laid|pluck|remov|c[ao]me|lift|get|lung|tr[yi]|attempt|reach"),
        verbs.PUT: re.compile(r"plac|dropp|stow|laid|deposit|stor|toss|thr|deliver|shov|tuck|popp|mov|slipp|park|put|set|left"),
        verbs.TOGGLE: re.compile(r"switch|turn|flick|flipp|toggl|power|shut"),
        verbs.NAVIGATE: re.compile(r"gone|w[ea]n?t|been|walk|mov|travel|navig|return|head|run|hurr|step|roll|driv|drov|c[ao]me|got|popp|stopp|ma[kd]e|pa[iu]|visit|reach|approach|call|set|dropp|arriv|swung|go"),
        "searched": re.compile(r"search|check|examin|inspect|explor|investig|comb|rummag|gone|went|been|go|sift|look|peer|peek|glanc|had|tak|took|pok|dug|stuck|rul|tri|cross"),
    },
    denied_deeds={
        verb: (
            re.compile(rf"\b(?:i|we) (?:did not|didn't|never did|did never)(?: (?:ever|even|once|actually|yet))* (?:{words}) {_D}{_OF}{_X}"),
        )
        for verb, words in (
            (verbs.OPEN, "open|pull open"),
            (verbs.CLOSE, "close|shut"),
            (verbs.PICKUP, "pick up|take|grab|touch|collect|fetch"),
            (verbs.NAVIGATE, "(?:go|get|come|walk|move|travel|head)(?: over| back| up)?(?: anywhere near| near| to| by)|visit|approach|reach"),
            ("searched", "(?:look|peek|peer)(?: into| in| inside| through)|search|check|inspect|examine"),
        )
    },
    first_try=re.compile(r"\b(?:at|on|with) (?:the|my) (?:very )?first (?:try|attempt|go|grab|shot)|\bfirst time round|\bfirst (?:try|attempt|grab) (?:worked|succeeded|went)|\b(?:straight off|in one go|at once|without a hitch)\b"),
    undone=re.compile(r"\b(?:nobody|no one|never|not|nothing|without|neither|nor|none|no|yet to|failed|unable)\b|n't\b"),
    unwilling=re.compile(r"\b(?:cannot|can't|rather than|instead of|tried to|meant to|wanted to|needn't|about to)\b"),
    in_vain=re.compile(r"[^,.;§]{0,12}\b(?:in vain|without success|to no avail|but (?:it )?failed|failed|came to nothing|missed)\b"),
    once_more=re.compile(r"\b(?:back|again|off|twice|a second time|properly|fully|quite|thoroughly|either of)\b"),
    nothing={
        verbs.OPEN: re.compile(r"(?:\bnot|n't|\bnever|yet to)(?: (?:yet|even|actually|ever|so far))* (?:opened?) (?:a (?:single )?thing|anything|any (?:of (?:the|these) )?(?:container|door|thing)s?|one thing)\b|\bopened (?:nothing|not a thing)\b|\bnothing(?: at all)? (?:has been|was|is) opened\b|\bwithout (?:ever |once )?opening anything\b"),
        verbs.PICKUP: re.compile(r"(?:\bnot|n't|\bnever|yet to)(?: (?:yet|even|actually|ever|so far))* (?:picked up|taken|touched|pick up|take|grabbed) (?:a (?:single )?thing|anything|any (?:item|object)s?)\b|\b(?:picked up|taken|grabbed) (?:nothing|not a thing)\b|\bpicked nothing up\b|\bnothing(?: at all)? (?:has been|was) (?:picked up|taken)\b"),
        verbs.NAVIGATE: re.compile(r"(?:\bnot|n't|\bnever|yet to)(?: (?:yet|even|actually|ever|so far))* (?:moved|gone anywhere|left (?:the )?(?:start|spot|my spot|where i (?:started|began))|budged|taken a (?:single )?step|gone to (?:any|a single) (?:place|thing))\b|\bnot moved (?:an inch|at all)\b"),
    },
    none_here=re.compile(r" (?:in|on|here|there|else|inside|near|at(?! all)|with|since|from|other|but|except|that)\b"),
    none_of_them=re.compile(r"\bany of\b"),
    plain_verbs={
        verbs.OPEN: re.compile(r"\b(?:open(?:ed|ing)?|pull(?:ed|ing)|lift(?:ed|ing)?|raising)\b"),
        verbs.CLOSE: re.compile(r"\b(?:clos(?:e|ed|ing)|shut(?:ting)?|lower(?:ed|ing)?)\b"),
        verbs.PICKUP: re.compile(r"\b(?:pick(?:ed|ing)?|tak(?:e|en|ing)|took|grab(?:bed|bing)?|fetch(?:ed|ing)?|get(?:ting)?|got|collect(?:ed|ing)?|hand|grip)\b"),
        verbs.PUT: re.compile(r"\b(?:put(?:ting)?|plac(?:e|ed|ing)|drop(?:ped|ping)?|insert(?:ing)?|stow(?:ed|ing)?)\b"),
        verbs.TOGGLE: re.compile(r"\b(?:switch(?:ed|ing)?|turn(?:ed|ing)? o(?:n|ff)|toggl(?:e|ed|ing)|flick(?:ed)?)\b"),
        verbs.NAVIGATE: re.compile(r"\b(?:went|gone|go|going|walk(?:ed|ing)?|stopped|visit(?:ed|ing)?|reach(?:ed|ing)|came|arriv(?:ed|ing)|head(?:ed|ing)|stood)\b"),
    },
    failing=re.compile(r"\b(?:fail(?:ed|ure)?|attempt|tried|try|couldn't|could not|missed|in vain|nothing|didn't|unsuccessful|grab at)\b"),
    order=(
        re.compile(r"\bfirst(?:,| i|ly|\b)(?P<a>[^.;]{0,120}?§[^.;]{0,120}?)(?:,|\band\b)?\s*(?:and )?(?:only )?(?:then|afterwards|after that|next|later|later on)\b(?P<b>[^.;]{0,120}?§)"),
        re.compile(r"(?P<a>[^.;,]{0,90}§[^.;,]{0,90}?)(?: even| well| long| right| just)? before (?P<b>(?:i|ever|going|opening|picking|taking|touching|visiting|turning|checking|looking|even|so|the|my|that)\b[^.;,]{0,90}?§)"),
        re.compile(r"(?P<a>[^.;]{0,120}§[^.;]{0,120}?)(?:,| and|;)+ (?:and )?(?:it was )?(?:only )?(?:then|afterwards|afterward|after that|later|subsequently)(?: that| did| on)? (?P<b>[^.;]{0,120}?§)"),
        re.compile(r"\bit was(?: only)? after (?P<a>[^.;]{0,120}?§[^.;]{0,120}?) that (?P<b>[^.;]{0,120}?§)"),
        re.compile(r"(?P<a>[^.;,]{0,90}§[^.;,]{0,90}?) (?:first|beforehand),? (?:and )?(?:only )?(?:then|afterwards|after that|later)\b(?P<b>[^.;,]{0,90}?§)"),
        re.compile(r"(?P<b>[^.;,]{0,90}§[^.;,]{0,90}?) (?:only |right |just |shortly )*after (?P<a>(?:i|having|opening|picking|taking|visiting|going|checking|looking|closing|reaching|switching|putting|the|my)\b[^.;,]{0,90}?§)"),
        re.compile(r"^(?:the |my )?(?P<a>§)(?: (?:was (?:done|dealt with|handled|seen to|opened|searched|checked|visited|moved|picked up|put away)|came))? first(?: of all)?,? (?:and )?(?:then )?(?:the |my )?(?P<b>§) ?(?:second|next|then|afterwards|after (?:it|that)|later|last)\b"),
        re.compile(r"^first(?: came| it was| i (?:went|walked|headed|tried|searched|checked|opened))?(?: to| for)? (?:the |my )?(?P<a>§),? (?:and )?(?:then|next|after that|afterwards)(?: came| it was| i \w+)?(?: to| for)? (?:the |my )?(?P<b>§)"),
        re.compile(r"\bi (?P<a>[^.;,§]{0,30}§[^.;,§]{0,15}?) first(?: of all)?,? (?:and |before )?(?:i )?(?P<b>[^.;,§]{0,30}§)"),
        re.compile(r"(?P<b>[^.;]{0,60}§[^.;]{0,40}?),? but not before (?P<a>[^.;]{0,60}?§)"),
        re.compile(r"(?P<a>[^.;]{0,90}§[^.;]{0,60}?) (?:by the time|when at last|long before) (?P<b>(?:i|the|my|any)\b[^.;]{0,60}?§)"),
        re.compile(r"\b(?:i )?(?:first|started with|began with|started (?:out|off)|to start with)\b(?P<a>[^.;§]{0,40}§)[^.;§]{0,20}[;,]? (?:and )?(?P<b>(?:the |then |only then )?[^.;§]{0,30}§[^.;]{0,40}?)(?: came| followed| was| were)(?: only)? (?:after|later|next|then|second|last)\b"),
        re.compile(r"^after (?P<a>(?:the |my )?§),? (?:i (?:took on|turned to|went|moved|did|opened|tried|searched|dealt with)|came|it was) (?P<b>[^.;]{0,40}?§)"),
        re.compile(r"(?P<a>[^.;]{0,60}§[^.;]{0,20}?) (?:at the (?:very )?(?:start|outset)|first of all|to begin with)[^.;§]{0,10}[;,] (?:and )?(?:it was )?(?:only )?(?:later|afterwards|then|after that)(?: that)? (?P<b>[^.;]{0,60}?§)"),
        re.compile(r"(?P<a>§) was the (?:very )?first thing[^.;§]{0,30},? (?:and )?(?P<b>(?:the |my )?§) (?:came|followed|was)[^.;§]{0,10} (?:after|later|next|second|then)"),
        re.compile(r"\b(?:i )?(?:started|began)(?: out| off)? (?:with|at|by) (?P<a>[^.;§]{0,30}§)[^.;]{0,60}?(?:moved on|went on|finished|ended|proceeded|continued|turned)(?: up| on)? (?:to|with|at|by) (?P<b>[^.;§]{0,30}§)"),
        re.compile(r"\bonly (?:once|after|when) (?P<a>[^.;,]{0,90}?§[^.;,]{0,90}?),? did i (?P<b>[^.;,]{0,90}?§)"),
    ),
    planned=re.compile(r"\b(?:will|'ll|let|going to|shall|should|need|must|could|would|can|may|might|want|plan|if|if i|until|to do|i'm|i am|had i|hadn't|next step)\b"),
    told=re.compile(r"(?<!nobody )(?<!didn't )(?<!not )(?<!never )\b(?:the complaint was|the reason (?:given|was)|complaint|said (?:that|my|the|it|there|none|no)|told(?! to\b)|system|message|feedback|remark|reply|replied|response|reported|complain(?:ed|t)|came back (?:as|with)|was (?:turned down|refused|rejected|denied)|refused (?:to|when|my)|notice (?:said|read)|notified|informed|according to (?:the )?(?:system|message|answer|reply|feedback|response)|warned|advised|error said|it said|they said(?! to\b))\b"),
    answers={
        "full hand": re.compile(r"\b(?:hands?|arms?|grip|gripper) (?:was|were|is|are|being|already|had been)?\s*(?:already )?(?:full|occupied|busy|taken)|full hands?|already (?:held|holding|carrying|hold)|too (?:much|many)(?: things)? in my hands?"),
        "empty hand": re.compile(r"\b(?:hands?|grip|gripper) (?:was|were|is|are) empty|nothing in my hand"),
        "far": re.compile(r"\btoo (?:far|distant)|(?:out of|beyond|not (?:within|in)|wasn't (?:within|in)|none (?:is|was) within|isn't within|no [^,.]{0,20} within) (?:my )?reach|can(?:not|'t) reach|couldn't reach|come closer|get closer|not near enough|not close enough"),
        "stuck": re.compile(r"\b(?:wouldn't|would not|won't|didn't|refused to|does not|doesn't|did not) (?:budge|open|move|give|come open|close|shut)|\b(?:stuck|locked|jammed|sealed|blocked)\b|(?:lifting|opening|closing|shutting|raising|pulling)[^,.]{0,25}(?:was|were|got) (?:refused|rejected|denied|turned down)"),
        "no room": re.compile(r"\b(?:is|was|were|already) (?:too )?full\b|no (?:room|space|place)\b"),
        "otherwise": re.compile(r"(?:\bit|\bthey|\bthat|§)(?: [a-z]+)? (?:was|were|is|are)(?: still| too| already| locked)* (?:inside|in the way|behind|wet|hot|heavy|big|slippery|fragile|in use|mine)\b|\bput (?:something|it) down|\bput down (?:something|what)\b|\balready (?:in my hand|holding|held)\b"),
        "no action": re.compile(r"\bno (?:such )?(?:valid |known )?action|names? no action|not (?:a|an) (?:valid |known )?action|(?:doesn't|does not|didn't|did not|not) (?:know|recogni[sz]e|understand)"),
        "done": re.compile(r"\bdone\b(?! with)|\b(?:success|succeeded|successful|all (?:was )?(?:well|fine|right)|went (?:fine|well|through|smoothly)|confirmed)\b"),
    },
    task=re.compile(r"\b(?:(?:was|am|been|i'm|i've been|being) (?:only |specifically |explicitly )?(?:asked|told|instructed|ordered|requested|sent)(?: here)? (?:to|for)|(?:task|job|instruction|instructions|request|order|errand|mission|assignment|brief)(?: (?:is|was|says|said|wants me|tells me|told me|asks me|requires me|demands|calls for|only says)| here is)*(?: to| for| that)?(?= (?!done|over|complete|finished))|(?:is|are) (?:supposed|meant) to(?! (?:live|come|stay|hang|lie|sit|stand|have)\b)(?! be (?:in|on|at|here|there|under|inside))(?: be)?|they (?:want|asked)(?: me)?(?: to)?|asked me to|wants me to)"),
    chores={
        "put": (re.compile(r"\b(?:put|place|drop|deposit|stow|store|deliver|leave|lay|set|move|bring|carry|take) (?:it|them|this|the §|a §|that §|§|both)?[^.;]{0,20}?\b(?:in|into|on|onto|inside|to|down|back)(?= (?:the |a |this |that |its )?(?:[a-z]+ )?§)"), re.compile(r"put|plac|drop|mov|bring|carr|set\b|store|throw|leave|deliver|deposit|stow|return|back|into|onto|belongs|放|摆|搁|送|移|收", re.I)),
        "take": (re.compile(r"\b(?:pick (?:it |them |the § |§ )?up|grab|pocket|get hold of|collect|hold)\b"), re.compile(r"pick|tak|grab|hold|hand|fetch|get\b|bring|put|plac|mov|carr|collect|lift|drop|slic|heat|cool|clean|wash|chill|throw|store|拿|取|放|捡|搁", re.I)),
        "heat": (re.compile(r"\b(?:heat(?:ed|ing)?|warm(?:ed|ing)?|cook(?:ed|ing)?|boil(?:ed)?|fry|fried|toast(?:ed)?|bake[d]?|roast(?:ed)?|microwaved)\b"), re.compile(r"heat|warm|cook|boil|fry|toast|bake|roast|\bhot\b|热|煮|烤|煎|加热", re.I)),
        "use": (re.compile(r"\b(?:play|read|eat|drink|watch|charge|fold|repair|fix|paint|feed|water|iron|decorate|serve|sharpen|unplug|plug in|measure|count|photograph|smell|taste)\b"), re.compile(r"play|read\b|eat|drink|watch|charg|fold|repair|fix|paint|feed|water|iron|decorat|serv|sharpen|plug|measur|count", re.I)),
        "wash": (re.compile(r"\b(?:wash(?:ed|ing)?|clean(?:ed|ing)?|rins(?:e|ed|ing)|scrub(?:bed)?|wipe[d]?|polish(?:ed)?)\b"), re.compile(r"wash|clean|rins|scrub|wipe|dirty|water|洗|清|擦", re.I)),
        "slice": (re.compile(r"\b(?:slic(?:e|ed|ing)|cut(?:ting)?|chop(?:ped)?|peel(?:ed)?)\b"), re.compile(r"slic|cut|chop|切", re.I)),
        "close": (re.compile(r"\b(?:clos(?:e|ed|ing)|shut(?:ting)?)\b"), re.compile(r"clos|shut|关|合", re.I)),
        "open": (re.compile(r"\bopen(?:ed|ing)?\b"), re.compile(r"open|打开|开|拉", re.I)),
        "break": (re.compile(r"\b(?:break|broken|smash(?:ed)?|crack(?:ed)?)\b"), re.compile(r"break|broke|smash|crack|打碎|打破", re.I)),
        "fill": (re.compile(r"\b(?:fill(?:ed)?|pour(?:ed)?|empty it|emptied)\b"), re.compile(r"fill|pour|empty|倒|装", re.I)),
        "throw": (re.compile(r"\b(?:thrown? (?:away|out|in)|discard(?:ed)?|dispose|bin it)\b"), re.compile(r"throw|discard|dispos|garbage|bin|trash|扔|丢|垃圾", re.I)),
        "switch": (re.compile(r"\b(?:switch(?:ed)?|turn(?:ed)?) (?:it |them |§ )?(?:on|off)\b"), re.compile(r"switch|turn|light|lamp|toggle|\bon\b|\boff\b|power|lit|dark|run|开|关", re.I)),
    },
    goes_into=re.compile(rf"\b(?:put|place|drop|deposit|stow|store|deliver|leave|lay|set|move|bring|carry|take|get|go|goes|throw|thrown|moved|brought|carried)\b[^.;]{{0,30}}?\b(?:in|into|on|onto|inside|to|on top of|over to) {_D}{_Y}"),
    rooms={
        "kitchen": re.compile(r"\b(?:kitchen|kitchenette|pantry|galley)\b(?! §)"),
        "bathroom": re.compile(r"\b(?:bathroom|washroom|restroom|lavatory|shower room)\b(?! §)"),
        "bedroom": re.compile(r"\b(?:bedroom|bedchamber|dormitory|sleeping quarters)\b(?! §)"),
        "living room": re.compile(r"\b(?:living[- ]room|lounge|sitting[- ]room|parlou?r)\b(?! §| chair)"),
        "other": re.compile(r"\b(?:garage|basement|attic|classroom|hallway|corridor|cellar|garden|laundry room|dining room|library|workshop)\b(?! §)"),
    },
    any_room=re.compile(r"room|kitchen|pantry|galley|lavatory|bedchamber|dormitory|quarters|lounge|parlo|garage|basement|attic|hallway|corridor|cellar|garden|library|workshop"),
    room_in_general=re.compile(r"\b(?:another|other|next|most|any|every|different|usually|normally|typically|often|if|were|not|n't|than|instead|belongs?|rather|would be|outside|towards?|no)\b|\b(?:kitchen|bathroom|bedroom|living room)s\b"),
    states=(
        re.compile(rf"{_X}(?: doors?| lid| light)?(?: (?:(?:over )?(?:on|to|off to) (?:my|the) (?:left|right|side)|ahead|in front of me|here|there|itself|nearby))?(?: (?:is|are|hangs?|stands?|stays?|remains?|sits?)|'s|,? with its doors?)(?P<no>n't| not| no longer)?(?: (?:still|already|now|just|also|quite|both|all|currently|clearly|hanging|standing|lying|drawn|pulled|pushed|switched|turned|left|wide|fully|properly|tightly|firmly|brightly|swung|merrily|flung|half|left))* (?:(?P<open>open|ajar|agape|gaping|unlatched)|(?P<closed>shut|closed|sealed|drawn(?= |$|[,.;])(?! back| up| open))|(?P<on>on(?=$|[,.;]| and\b| but\b| again)|lit|burning|running|glowing|blazing|humming|alight|gushing|flowing|dripping|shining|whirring|boiling|brewing|playing)|(?P<off>off(?=$|[,.;]| and\b| but\b| again| now)|out(?=$|[,.;]| and\b)|dark|unlit))\b(?! by\b| up\b|-| to\b| in\b| out of\b)"),
        re.compile(rf"\b(?:with|and) (?:the|its) {_X}(?: doors?| lid)? (?:still |already |now |standing |hanging |wide )*(?:(?P<open>open|ajar|gaping|agape)|(?P<closed>shut|closed)|(?P<on>lit|running|burning|glowing)|(?P<off>unlit))(?=$|[,.;])(?P<no>(?!))?"),
        re.compile(rf"^(?:the |my )?{_X}(?: doors?| lid)? (?:still |both |now |already |standing |wide |firmly |tightly )*(?:(?P<open>open|ajar|gaping|agape)|(?P<closed>shut|closed)|(?P<on>lit|running|burning|glowing)|(?P<off>unlit))(?=$|[,.;])(?P<no>(?!))?"),
    ),
    loose_states=(
        re.compile(rf"{_X}(?:'s)?(?: doors?| lid| cover| screen| light)?,?(?P<said>[^§,.;:?!]{{0,34}}?)\b(?:(?P<open>open|ajar|agape|gaping|gapes?|yawning|yawns?|unlatched|unshut|flung wide|pulled out|slid out|drawn back|swung wide|raised|lifted|ajar)|(?P<closed>shut|closed|sealed|latched|unopened|fastened|pushed (?:in|home|to)|pulled to|drawn(?! back| up| open)|lowered)|(?P<on>on|lit|burning|burns|glowing|glows?|alight|ablaze|aglow|running|runs|humming|buzzing|whirring|shining|shines|switched on|playing|blaring|gushing|gushes|flowing|flows|dripping|drips|flickers|flickering|blazing|blazes|working|going|heating|brewing)|(?P<off>off|dark|unlit|switched off|extinguished|out|powered down|dead|lifeless|dormant|black))(?=$|[,.;:!)]| (?:and|but|now|again|already|so|while|at|like|just|too|as|because|since|though|in front of me|before me|beside me|behind me|right here|this|for)\b)"),
        re.compile(rf"\b(?P<said>somebody|someone|who(?:ever)?|i|i've|i have|they|he|she) (?:has |have |had )?(?:left|kept|leave|found|find|see) (?:the |that |this |my |a )?(?:[a-z-]+ )?{_X}(?: (?:standing|still|wide|switched|hanging|all|fully|half))* (?:(?P<open>open|ajar|gaping|agape)|(?P<closed>shut|closed|sealed)|(?P<on>on|lit|burning|running|glowing)|(?P<off>off|unlit|dark))(?=$|[,.;:!)]| (?:and|but|behind|when|as|so|for|while|all)\b)"),
    ),
    being=re.compile(r"(?:\b(?:is|are|'s|stands?|sits?|hangs?|stays?|remains?|looks?|has been|have been|was left|were left|left|gapes?|yawns?|burns|glows?|runs|hums|shines|flows|drips|gushes|blazes|lies|seems)\b|^'s)[^,]*$"),
    is_someone=re.compile(r"(?:somebody|someone|who(?:ever)?|i|i've|i have|they|he|she)$"),
    all_of=re.compile(r"\b(?:all(?: of)?(?: the| my| these| those| four| three| five| six)*|every(?: single| one of (?:the|these|those))?|each(?: and every| of (?:the|these|those))?|both(?: of)?(?: the| these| those)?) (?:[a-z-]+ )?$"),
    all_after=re.compile(r"^(?: [a-z]+){0,3} (?:all|both|each)\b"),
    none_of=re.compile(r"\b(?:no|none of (?:the|these|those|my|them)|neither(?: of)?(?: the| these| those| my)?|not one of (?:the|these|those))(?: [a-z-]+)? $"),
    state_since=re.compile(r",? (?:and|but) (?:then |now |later )*(?:shut|closed|opened|switched|turned|open|off|out)(?: (?:again|up|off|on|now))*\b|,? (?:when|until|before|as long as)\b"),
    at_times=re.compile(r"\b(?:when|whenever|while|until|before|as long as|by the time|to (?:have|hold|be holding|carry))\b"),
    poured=re.compile(rf"\bwater(?: is| was|'s)?(?: (?:already|still|now|just|happily|merrily|even))* (?:runs?|running|gush(?:es|ing)|flow(?:s|ing)|pour(?:s|ing)|drip(?:s|ping)|splash(?:es|ing)|stream(?:s|ing)|trickl(?:es|ing)|comes|coming)\b[^,.;]{{0,40}}?(?:from|out of|at) {_D}{_X}"),
    held=(
        re.compile(rf"{_X}(?:,? (?:is|are|sits|rests|lies|hangs|feels|dangles|nestles|weighs)|'s|'s been| has been)?(?: (?:[a-z]+ly|now|still|already|safe|snug|tight|right|here|there|hooked|wrapped|clasped|cradled|clutched|tucked|held|resting|sitting|dangling|nestled|pinched|squeezed|wedged|gripped|heavy|light|warm|cold|cool))* (?:in|within|between|under|over|round|around|from) (?:my|both|one) (?:(?:left|right|own|other|bare|steady) )?(?:hands?|palms?|grip|grasp|gripper|fingers?|fingertips|thumb|fist|arms?|elbow|possession|clutches|pincers|claws?)\b"),
        re.compile(rf"\bmy (?:fingers|hands?|fist|grip|arms?|gripper|palm|thumb) (?:is|are|'s|has|have)?(?: (?:[a-z]+ly|now|still|already))* ?(?:closed?|wrapped|curled|clenched|clasped|tight|locked|folded|closes|holds?|grips?|clutch(?:es)?)(?: (?:around|round|on|about|over|firmly))* {_D}{_X}"),
        re.compile(rf"{_X}(?: (?:[a-z]+ly|now|still|already|safe|tight))* (?:(?:is|'s) (?:finally |now |already |safely )?(?:mine|with me|on me|in safe hands|in my possession|in the bag|secured?)|weighs (?:[a-z]+ )?(?:on|in) (?:me|my))(?=$|[,.;!]| (?:now|at last|and|so|already))"),
        re.compile(rf"\bi(?:'m| am) (?:now |still |already )?the (?:proud |happy |lucky )?(?:owner|holder|bearer|keeper) of {_D}{_X}"),
        re.compile(rf"{_X}(?:,? (?:is|are)|'s)?(?: (?:now|still|already|firmly|safely|securely|sitting|resting|lying|nestled|snug|snugly|clutched|tucked|held|tight|gripped|right|here|there|clasped))* (?:in|within|between|under) my (?:(?:left|right|own|other) )?(?:hands?|palms?|grip|grasp|gripper|fingers|fist|arms?|possession|clutches)\b"),
        re.compile(rf"\b(?:what|the thing|the object|all) (?:that )?i(?:'m|'ve| am| have)?(?: (?:currently|now|actually|still))* (?:hold|holding|carry|carrying|got|have|clutching|gripping)(?: in my hand| with me| here)? is {_D}{_X}"),
        re.compile(rf"\b(?:i am|i'm|i)(?: (?:now|still|already|currently|also|finally|just|here))* (?:clutching|gripping|grasping|cradling|toting|hugging|lugging|clasping|clutch|grip|cradle)(?: on to| onto)? {_D}{_X}"),
        re.compile(rf"^(?:and |but |so |now |with )*(?:the |a |an |this |my )?{_X}(?: (?:safely|firmly|securely|already|now|finally))* in (?:hand|my (?:hand|grip|palm))(?=$|[,.;:])"),
    ),
    lies_on=(
        re.compile(rf"{_X}(?: (?:is|are|lies?|sits?|stands?|rests?|hangs?|waits?)|'s)(?: (?:now|still|already|just|right|over|there|also|both|safely|neatly|good|carefully|happily|waiting|calmly|standing|sitting|perched|draped|lying|resting|hanging|balanced|propped|placed|left|leaning|stacked|piled|laid|set|kept|stowed|tucked|parked|slung|spread|mounted|hung))* (?:on|in|inside|over|atop|on top of|upon|within) (?:(?:the (?:edge|rim|top|corner|surface|lid|arm|back|seat|front|bottom|side) of|one of|each of|some of) )?{_D}{_Y}"),
        re.compile(rf"{_X}(?: (?:now|still|already|just|right|over|there|has been left|have been left|was left|had been left|has been))* (?:standing|sitting|perched|draped|lying|resting|hanging|balanced|propped|leaning|stacked|piled|parked|slung|waiting) (?:on|in|inside|over|atop|on top of|upon|within) (?:(?:the (?:edge|rim|top|corner|surface|lid|arm|back|seat|front|bottom|side) of|one of|each of|some of) )?{_D}{_Y}"),
        re.compile(rf"{_X} (?:was|were|has been|have been) left (?:on|in|inside|over|atop|on top of) {_D}{_Y}"),
    ),
    never_seen=(
        re.compile(rf"(?:(?<!could )(?<!did )(?<!do )\bnot|(?<!could)(?<!did)(?<!do)(?<!ca)n't|\bnever|yet to)(?: (?:yet|once|even|ever|actually|so far|already))* (?:seen|laid eyes on|set eyes on|come across|spotted|noticed|sighted|encountered|glimpsed|caught sight of|lay eyes on|see|had sight of|run into|met)(?: (?:a|any|either|sign|trace|of|single|so|much|as|an?))* {_D}{_X}"),
        re.compile(rf"{_X} (?:has|had|have|'s)(?: (?:still|so far|yet|simply))*(?:n't| not| never| yet)(?: (?:yet|so far|once|ever|even))* (?:to )?(?:shown?(?: (?:itself|up|its face|themselves))?|turned up|appeared|crossed my path|come into (?:view|sight)|surfaced|been (?:seen|spotted|sighted|in view|in sight)|emerged|come up|caught my eye|revealed itself|made an appearance|popped up|met my eyes?)"),
        re.compile(rf"\bno {_D}{_X} (?:has|had|have)(?: (?:yet|so far|ever))* (?:shown (?:itself|up)|turned up|appeared|crossed my path|come into (?:view|sight)|surfaced|been (?:seen|spotted|sighted)|caught my eye|emerged)"),
        re.compile(rf"{_X},? (?:which |that |whom )?i(?:'ve| have) (?:not|never|yet to|n't)(?: (?:yet|once|even|ever|so far|actually))* (?:seen|laid eyes on|come across|spotted|noticed|encountered|set eyes on|see)"),
        re.compile(rf"{_X},? (?:which |that )?i haven't(?: (?:yet|once|even|ever|so far|actually))* (?:seen|laid eyes on|come across|spotted|noticed|encountered|set eyes on|found)"),
        re.compile(rf"\b(?:i have|i've)(?: (?:so far|yet|still))? (?:seen|spotted|come across|noticed) (?:no|nothing of(?: the| an?)?|no trace of(?: the| an?)?|neither hide nor hair of(?: the| an?)?) {_D}{_X}"),
        re.compile(rf"\bdoubt (?:that )?(?:i've|i have) ever (?:seen|come across|spotted|noticed) {_D}{_X}"),
        re.compile(rf"{_X} (?:remains?|is still|is|stays?|has remained) (?:unseen|a mystery to my eyes)"),
    ),
    here_only=re.compile(r"\b(?:from here|here|now|in this view|in here|this time|at the moment|currently|right now|since|again|any ?more|up close|clearly|properly|lately|from this|in it|among them|on it|inside it)\b|\b(?:in|on|inside|at|near|by|under|from|behind) (?:the |this |that |any |my |a )?(?:[a-z]+ )?§"),
    seen_then=(
        re.compile(rf"\b(?:i|i've|i'd|i have|i had|we)(?: (?:also|already|just|even|first|last|only|did|clearly|do|definitely))* (?:saw|seen|noticed|spotted|caught sight of|glimpsed|came across|observed|made out|remember seeing|recall seeing|remember|recall)(?: (?:also|already))* {_D}{_X}"),
        re.compile(rf"{_X} (?:was|were|had been|came)(?: (?:there|already|also|clearly|first|last))* (?:in (?:view|sight)|visible|seen|spotted|noticed|into view|into sight)"),
        re.compile(rf"{_X} (?:that |which )?i (?:saw|noticed|spotted|glimpsed|had seen)"),
    ),
    since_here=re.compile(r"\bsince (?:i )?(?:came|coming|arriving|arrived|got|getting|reaching|reached|walking|walked|moving|moved|standing)\b(?: (?:over|up|across|back|here|to|at|in front of|this|that|the|by|near))*"),
    while_at=(re.compile(rf"\b(?:(?:while|when|as|back when|from when) (?:i was|i stood|i'd been|i had been|standing|over)(?: (?:standing|still|over|back|there|only|just))*(?: (?:at|by|near|beside|next to|in front of|with))+|(?<=§ )from|(?:once|after|when|as|while) (?:i (?:had |was )?)?(?:opening|opened|reaching|reached|getting to|got to|visiting|visited|walking (?:over )?to|walked (?:over )?to|going to|went to|arriving at|arrived at|came to|coming (?:over )?to|pulling back|pulled back|drawing|drew|checking|searching|looking in|looked in|looked into)) {_D}{_Y}"),),
    only_then=re.compile(r"\b(?:only|first time|not until|for the first time|first saw|first spotted|first noticed)\b"),
    last_then=re.compile(r"\b(?:last (?:time|saw|seen|spotted|noticed|laid eyes|sight)|last)\b"),
    not_in_view=(
        re.compile(rf"^(?:the |a |any )?{_XS},? (?:not (?:here|anywhere|in (?:sight|view)|that i (?:can|could) (?:see|tell|make out)|to be seen|around|present|visible|as far as i (?:can )?see)|nowhere\b|absent|is (?:absent|nowhere|not (?:here|around|present|about))|isn't (?:here|around|present|about|anywhere)|there is none|there's none|none here|none at all|gone without a trace)"),
        re.compile(rf"\b(?:no|not a(?: single)?|not one) {_D}{_XS} (?:is |are |stands |lies |meets |greets |lies )?(?:here|before (?:me|my eyes)|in front of me|around(?: me)?|near me|nearby|about|whatsoever|my eyes?|as far as|that i can (?:see|make out|spot)|in (?:this|the) (?:whole |entire )?(?:room|kitchen|bathroom|bedroom|house|living room|place|picture))(?=$|[,.;!:]| (?:from|to|i|and|so|but|that)\b)"),
        re.compile(rf"\b(?:(?:kitchen|room|bathroom|bedroom|place|house|living room|view|scene|picture|corner|spot)|this one|it) (?:has|had|have|offers|shows|contains|boasts|comes with) (?:no|not a(?: single)?|not one|neither) {_D}{_XS}(?=$|[,.;!:]| (?:at all|whatsoever|anywhere|to|that)\b)"),
        re.compile(rf"\b(?:lacks?|lacking|devoid of|without|with no|bare of|free of|short of) (?:a |an |any |so much as a )?{_D}{_XS}(?=$|[,.;!:]| (?:at all|whatsoever|anywhere|that i can see|in sight)\b)(?<=(?:.{{4}}))"),
        re.compile(rf"\b(?:look|looked|looking|search|searched|searching|scan|scanned)(?: [a-z]+){{0,2}} for (?:a |an |any |the )?{_D}{_XS}(?: here| around)?,? (?:and (?:look|search|find) )?(?:in vain|without success|without luck|to no avail|and find none|and see none)"),
        re.compile(rf"\bnot (?:a|the) (?:hint|trace|sign|glimpse|shadow|whiff) of (?:a |an |any |the )?{_D}{_XS}"),
        re.compile(rf"\b(?:can't|cannot|can not|don't|do not|couldn't|am unable to|unable to|fail to)(?: (?:yet|currently|even|actually|really|quite))* (?:see|make out|spot|find|notice|detect|discern|pick out|glimpse|identify|locate)(?: (?:a|an|any|the|single|sign|trace|of|glimpse))* {_D}{_XS}(?=$|[,.;!]| (?:anywhere|in (?:this|my|the) (?:view|picture|frame|field|room)|from here|here|at all|in sight|in view|from (?:this|where)|right now|yet|and|or|at the moment|among))"),
        re.compile(rf"\b(?:no|not a(?: single)?|no sign of(?: an?| any| the)?|no trace of(?: an?| any| the)?|nor(?: an?| any)?) {_D}{_XS} (?:within (?:view|sight)|in (?:sight|view|(?:this|my|the) (?:view|picture|frame|scene|field))|to be seen|anywhere|around here|from here|from (?:where|this)|is (?:in (?:sight|view)|visible|to be seen)|visible|can be seen|at all)"),
        re.compile(rf"\b(?:there's|there is|i see|i spot|see) no {_D}{_XS}(?=[,.;!]*$)"),
        re.compile(rf"\bthere (?:isn't|is not|aren't|are not|is) (?:a|an|any|no|one) {_D}{_XS} (?:to be seen|in sight|in view|around|anywhere|here|visible|in this view)"),
        re.compile(rf"{_XS} (?:is|are|'s)(?:n't| not)? (?:nowhere (?:to be seen|in sight|in view|around)|out of (?:sight|view)|(?:in sight|in view|visible|to be seen|anywhere (?:in sight|to be seen|in view)|around here|missing from view))(?<!'s in view)"),
        re.compile(rf"\bcan't see {_D}{_XS}(?=$|[,.;!])"),
        re.compile(rf"{_XS} (?:can't|cannot|can not) be (?:seen|made out|spotted|found|discerned)(?=$|[,.;!]| (?:from|anywhere|at all|here|right now|in this))"),
        re.compile(rf"{_XS} (?:is|are|'s) nowhere to be found"),
        re.compile(rf"\bno {_D}{_XS} (?:shows? up|turns? up|turned up|showed up|appears?)(?=$|[,.;]| in any| anywhere| in this view)"),
        re.compile(rf"\b(?:looked|searched|scanned) (?:all )?(?:around|round|everywhere|in every direction)[^.§]{{0,20}} (?:and|but) (?:i )?(?:found|saw|see) no {_D}{_XS}(?=$|[,.;])"),
    ),
    not_of_view=re.compile(r"\bin (?:my|the) hands?\b"),
    but_there=re.compile(r"(?!)"),
    until_then=re.compile(r"\b(?:before|until|till) (?:i|we)\b|\bby the time\b"),
    not_on=(
        re.compile(rf"\b(?:no|not a|not a single|without a|isn't a|is not a|isn't any|see no) {_D}{_X} (?:on|in|inside|on top of) {_D}{_Y}"),
    ),
    perhaps_on=(
        re.compile(rf"{_Y} (?:may|might|could|must|probably|perhaps|possibly|surely)(?: (?:well|also|just|be|have|still))* (?:has|have|hold|holds|hide|hides|hiding|holding|contain|contains|conceal|house) (?:one|it|them|{_D}{_X})"),
        re.compile(rf"(?:perhaps|maybe|possibly|probably) {_D}{_Y} (?:has|holds|hides|contains|conceals|houses) {_D}{_X}"),
        re.compile(rf"{_X},?[^§,]{{0,45}}?\b(?:in|inside|on|on top of|under|behind|near|by|beside|over by|into|over at|at)\b (?:one of |some |any )?{_D}{_Y}"),
    ),
    of_memory=re.compile(r"\b(?:saw|seen|noticed|spotted|remember|recall|was|were|still|earlier|had|left|put|back|before|same|glimpsed)\b"),
    another=re.compile(r"\b(?:another|second|more|other|else|spare|third|further|extra|also)\b"),
    seeing_now=(
        re.compile(rf"\bi (?:can )?(?:(?:clearly|now|also|still|already|even|just) )*(?:see|make out|spot)(?: that| both| now| already)? {_D}{_X}(?! (?:in my mind|being))"),
        re.compile(rf"\b(?:there's|there is|here's|here is) {_D}{_X} (?:right |just )?(?:here|there|in front of me|beside me|before me|to my (?:left|right)|on my (?:left|right)|ahead|in view|in sight)"),
        re.compile(rf"{_X} (?:is|are|'s)(?: (?:now|right|clearly|still|just|sitting|standing|lying|plainly|in fact))* (?:visible|in (?:plain |clear |full )?(?:view|sight)|(?:right )?in front of me|before me|right (?:here|there) in front)"),
    ),
    beside=(
        re.compile(rf"{_X} (?:is|are|'s|lies|sits|stands|rests|waits|lying|sitting|standing)(?: (?:right|just|there|lying|sitting|standing|waiting|over))* (?:next to|beside|alongside|close to|by|right by|in front of|between|to the (?:left|right) of) {_D}{_Y}"),
    ),
    strangers=re.compile(r"\b(?:washing machine|washer|dishwasher|tumble dryer|dryer|banana|bananas|orange juice|oranges|pear|pears|grape|grapes|lemon|lemons|carrot|carrots|onion|onions|cheese|milk|butter dish|cake|pizza|sandwich|blender|mixer|juicer|rice cooker|air fryer|scissors|hammer|screwdriver|umbrella|backpack|suitcase|handbag|hat|coat|jacket|jeans|trousers|shirt|guitar|piano|violin|radio|printer|camera|fireplace|air conditioner|aquarium|fish tank|cat|dog|bicycle|bike|skateboard|crib|bunk bed|hammock|toothbrush|toothpaste|hairdryer|hair dryer|comb|razor|shampoo|ironing board|ladder|broom|mop|cutting board|chopping board|whisk|corkscrew|teaspoon rack|jewelry box|jewellery box|headphones|game console|bathrobe)\b"),
    sees=re.compile(r"\b(?:i (?:can )?(?:clearly |also |now |just )?(?:see|spot|notice|saw|make out|spotted|noticed)|there's|there is|there are|there stands|here's|sits|stands|lies|stand|sit|lie|hangs|is (?:standing|sitting|lying|right|hanging|in view|in sight|visible|on my|to my|next to|beside|on the|in the)|catches my eye|in view|in sight)\b"),
    numbers={"two": 2, "both": 2, "pair of": 2, "couple of": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10, "eleven": 11, "twelve": 12, "a dozen": 12, "dozens of": 20, "half a dozen": 6, "a trio of": 3, "trio of": 3, "a quartet of": 4, "a couple of": 2, "a pair of": 2, "twin": 2, "several": 3, "a row of": 3, "a line of": 3, "a whole row of": 3, "a handful of": 3, "a bunch of": 2, "many": 3, "lots of": 3, "plenty of": 3, "countless": 4, "any number of": 3, "a host of": 3, "a column of": 3, "a stack of": 2, "a pile of": 2, "a set of": 2, "a good many": 3, "quite a few": 3, **{str(n): n for n in range(2, 21)}},
    counted=re.compile(rf"\b(?P<n>half a dozen|dozens of|a trio of|a quartet of|twin|several|a (?:whole )?row of|a line of|a handful of|lots of|plenty of|countless|a host of|a column of|a good many|quite a few|two|pair of|couple of|three|four|five|six|seven|eight|nine|ten|eleven|twelve|a dozen|[2-9]|1\d|20) (?:of )?(?:(?:the|these|those|identical|separate|different|small|large|big|closed|open|shut|whole|matching|ripe|red|green|white|black|brown|wooden|empty|little|more|rolls of|bottles of|bars of|loaves of|pieces of|sheets of|slices of|other|nice|tall|fresh|clean|dirty|neat|shiny) )*{_X}"),
    only=(
        re.compile(rf"\b(?:no more than|nothing but|nothing beyond|not more than) (?:one|a single|a) (?:[a-z-]+ )?{_X}"),
        re.compile(rf"\b(?:apart from|except for|besides|other than|but for|save for) (?:the |this |that )?(?:one|a single|a lone|a solitary) (?:[a-z-]+ )?{_X}"),
        re.compile(rf"\b(?:one(?: and only)?|a single|a lone|a solitary) (?:[a-z-]+ )?{_X}(?:,? (?:and|but))? (?:only|no more|and that's (?:it|all)|in all|all told|in total|altogether|and not one more|and nothing more)\b"),
        re.compile(rf"{_X}:? (?:just|only|a mere|exactly) (?:the |a )?(?:one|single one)\b(?! (?:of|is|more))"),
        re.compile(rf"\b(?:there is|there's) (?:exactly|precisely|but|just|only) (?:one|a single) (?:[a-z-]+ )?{_X}"),
        re.compile(rf"\b(?:only|just|merely|but|no more than|nothing but|nothing more than|exactly)(?: (?:see|make out|spot|count|find|the|can|be))* (?:one|a single|a lone|a solitary|the one)(?: (?!of\b)[a-z-]+){{0,2}} {_X}"),
        re.compile(rf"\b(?:a single|a lone|a solitary|the sole|the lone|the single|one lone|one single|the only|one and only one|(?:its|the|this) one and only) (?:[a-z-]+ )?{_X}"),
        re.compile(rf"\bthe one {_X}(?= (?:that )?i (?:can )?(?:see|find|spot|make out)\b| here\b| in (?:view|sight)\b)"),
        re.compile(rf"\b(?:its|his|her|this|the) one and only (?:[a-z-]+ )?{_X}"),
        re.compile(rf"\b(?:make out|see|spot|count|find) (?:only |just |no more than )(?:one|a single) (?:[a-z-]+ )?{_X}"),
    ),
    only_before=re.compile(r"\b(?:only|just|merely|no more than|nothing more than)(?: (?:see|make out|spot|count|find|the|can|be|those|these))* $"),
    uncounted=re.compile(r"\b(?:tries|times|steps|metres|meters|minutes|need|want|asked|told|task|opened|searched|checked|visited|tried|places|already|earlier|so far|before|first|left to)\b|§ to [a-z]+"),
    near=re.compile(r"\b(?:(?:only |just |barely |hardly |but )?(?:one|a|two|a couple of|half a) (?:small |single |tiny |short )?(?:steps?|paces?|strides?) (?:away|off|from)|so near|near enough to touch|next to nothing|right up against|(?:right |just )?(?:under|at) my (?:nose|fingertips|elbow|elbows|feet|hand|side|toes)|so close\b|too close|a (?:mere )?(?:hand|hair|finger|palm|whisker|span)(?:'s)?(?:[ -]?(?:breadth|width|span))? (?:away|off|from)|a whisker|i (?:can|could) (?:almost |nearly |practically |easily |just )*(?:touch|nudge|kick|lick|smell|feel|flop|lean on|sit on|lay my hand)|(?:without|not even) (?:taking|having to take) a (?:single )?step|(?:no|not) more than an? (?:arm|hand)|bump(?:ing)? into (?:it|me|the)|within a (?:hand|foot)|(?:an inch|a foot|half a foot|a few inches|two inches) (?:away|from)|within (?:arm's|arms'|easy|my|hand's|a hand's|an arm's) (?:reach|length|breadth)|(?:a|an|at) (?:arm's|hand's|hand|arm)[- ]?(?:length|breadth)?(?: away)|inches (?:away|from)|(?:mere |a few |few )?(?:centimet(?:re|er)s|inches) (?:away|off|from)|(?:brushing|touching|pressed|pressing|up) against (?:me|my|my (?:arm|leg|side|elbow))|right (?:next to|beside) me|(?:so |very |really |extremely )close (?:that|i could|to me)|close enough to touch|i could (?:almost )?touch|a step away|just a step|right beside me|within touching distance|almost (?:touching|on top of) me|close at hand|right by my|at close range|on my doorstep|a stone's throw)"),
    far=re.compile(r"\b(?:way (?:off|over|across|down|back)|(?:stands?|lies|sits|is|are|hangs|so|too|very|rather|quite|pretty) (?:so |too |very |rather |quite |pretty )?far (?:away|off|out|back)|a (?:fair|good|long|considerable|great) (?:way|distance|bit|hike|walk|trek|stretch|piece|few steps|few paces)(?: (?:off|away|from|to))?|the length of the|at the (?:very )?(?:back|end) of the (?:room|kitchen|hall)|(?:at|on|in) the (?:other|far|opposite) (?:end|side|corner|wall)(?: of the (?:room|kitchen|bedroom|bathroom|house|place|floor)|(?=$|[,.;]))|(?:clear |all the way |right |clean )?across the (?:room|kitchen|bedroom|bathroom|floor|way)|far (?:away|off|from (?:me|here))|a long (?:way|walk|haul|trek)|quite a (?:way|distance|journey|walk|trek|hike)|(?:several|many|a good few|some|dozens of) (?:met(?:re|er)s|yards|paces|feet|steps) (?:away|off|from)|miles away|in the distance|distant|out of (?:my |arm's |easy )?reach|beyond (?:my |arm's )?reach|too far)"),
    metres=re.compile(r"\b(?:(?P<n>\d+(?:\.\d+)?|one|two|three|four|five|six|seven|eight|ten|half a) ?(?:m|met(?:re|er)s?)\b)"),
    compared=re.compile(r"\b(?:than|further|farther|closer|nearer|not|n't|nor|never|journey ahead if|was|were|earlier|get|got|until|before i|hardly far|no longer)\b"),
    of_any=re.compile(r"\b(?:a|an|any|some|every|each|most|one of (?:the|these|those)) (?:[a-z-]+ )?$"),
    contents=(
        re.compile(rf"{MARK}(?:'s| is| are| lies| sits| rests| waits| hides| stands)(?: (?!not\b|never\b|on\b|from\b|out\b)[a-z]+){{0,3}} (?:in|inside|within|behind|under) {_D}(?:closed |shut |unopened )?{_Y}(?: door| lid)?(?=$|[,.;]| (?:on|to|ahead|over|next|beside|right|already|and|of|in front|straight|here|there))"),
        re.compile(rf"{_Y}(?: door| lid)?(?: (?:on|to|ahead|over|next|beside|right|in front|straight|here|there|of)[^,.;§]{{0,25}})?,? (?:that |which )?(?:i(?:'ve| have)? (?:never|not)(?: yet| even)? [a-z]+|i haven't [a-z]+|i never [a-z]+),? (?:is|are|has|holds|contains|houses|hides|keeps|was) "),
        re.compile(rf"\b(?:behind|inside|within|in|under|beneath) {_D}(?:(?:closed|shut|unopened) )?{_Y}(?: door| lid)?(?: (?:on|by|near|beside|to|ahead|over|of|here|there|in front)[^,.;§]{{0,25}}(?:§[^,.;§]{{0,10}})?)?,? (?:(?:there|here)(?:'s| is| are)|sits?|lies?|is|are|waits?|hides?|rests?|sleeps?|lurks?|lives?|stands?|hangs?|awaits?|i(?:'ll)? find) (?!no\b|nothing to|anybody|what|where|how|the question|unknown|a mystery|anyone|my|out of)"),
        re.compile(rf"\b(?:fills?|lies|lie|sits?|waits?|wait|hides?|rests?|sleeps?|awaits?|are (?:stored|kept|hidden|tucked)|is (?:stored|kept|hidden|tucked)) (?:[a-z]+ )?(?:behind|inside|within|in|under) {_D}(?:closed |shut |unopened )?{_Y}(?: door| lid)?(?=$|[,.;])"),
        re.compile(rf"\b(?:fill|fills|crowd|stuff|occupy|occupies|line) {_D}(?:closed |shut |unopened ){_Y}"),
        re.compile(rf"\b(?:i know|i am sure|i'm sure|i'm certain|i am certain|no doubt|certainly|for sure|definitely)\b[^.;?§]{{0,40}}\b(?:behind|inside|within|in) {_D}(?:closed |shut )?{_Y}(?: door| lid)?[^.;?§]{{0,30}}\b(?:there's|there is|there are|sits|lies|is|are|waits)\b"),
        re.compile(rf"{_Y}(?: (?:over|there|here|on|to|my|the|left|right|ahead|in front of me|itself|of mine))*(?: (?:only|just|already|also|clearly|certainly|surely))* (?:holds?|contains?|houses|is (?:completely |totally |quite |half |already |fully |entirely )?(?:full|stuffed|packed|crammed|filled|stocked|loaded|bursting|empty|bare)|are (?:all |completely |totally |quite |already |fully )?(?:full|stuffed|packed|crammed|filled|stocked|loaded|bursting|empty|bare)|hides|conceals|has (?:nothing|a|an|the|some|only|just|plenty|more|enough|room|space)\b[^,.]{{0,30}}(?: (?:in|inside|within) it| inside| waiting| left| free)?)"),
        re.compile(rf"\b(?:inside|within|in|under) {_D}{_Y}(?: lid)?(?: (?:on|by|in|near|beside|under|to|over)[^,.;]{{0,25}})?,? (?:there's|there is|there are|sits?|lies?|is|are|waits?|i(?:'ll)? find)\b"),
        re.compile(rf"\b(?:there's|there is|there are) (?:(?!no\b)[a-z-]+ ){{0,3}}(?:{MARK} |nothing |plenty |room |space )?(?:[a-z-]+ ){{0,2}}(?:inside|within|in|under) {_D}{_Y}"),
        re.compile(rf"\b(?:is|are|sits|lies) (?:all |everything )?(?:there is|that is|that's|there's) (?:in|inside) {_D}{_Y}"),
        re.compile(rf"{MARK} (?:is|are|'s|sits|lies|waits|hides)(?: (?:right|sitting|lying|waiting|hidden|hiding|safely|tucked away|already|still))* (?:in|inside|within) {_D}{_Y}"),
        re.compile(rf"\bevery one of {_D}{_Y} is\b"),
    ),
    shut=re.compile(rf"\b(?:closed|shut|unopened|never-opened|untouched) {MARK}|{MARK},? (?:that |which )?(?:i(?:'ve| have)? (?:never|not|n't|haven't)(?: yet| even)? (?:opened|touched|looked (?:in|into)|checked)|i haven't (?:opened|touched|looked into|checked)|(?:was|is|has been) never opened|nobody has opened)"),
    ignorance=re.compile(r"\b(?:don't know|do not know|can't (?:tell|say|know|be sure)|cannot (?:tell|say|know|be sure)|no idea|anybody's guess|anyone's guess|who knows|unknown|no telling|hard to say|wonder|remains to be seen|mystery|secret|i'll see|let me see|find out)\b"),
)  # fmt: skip
"""English."""
