"""Claims read from the words of a clause, in whatever order they stand.

The other readers know how a claim is worded. These look for a word of each part of it: who, did
what, to which thing. They read a clause only if it names one thing, or as many as the claim is
about, and if no word in it may turn its sense.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from er_gym.data.action_claims import has_done
from er_gym.data.claims import is_placing, not_on
from er_gym.data.clauses.lexicon import Words
from er_gym.data.clauses.reading import Span, Verdict, clauses_of, lexicon_of, sentences_of
from er_gym.data.mentions import Mention, all_interchangeable, find_mentions, named_in
from er_gym.data.phrases import MARK
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought, name_of
from er_gym.data.trajectory import Language
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES

_BY = Mapping[Language, Words]


def _words(english: str, chinese: str) -> _BY:
    return {"en": re.compile(english), "zh": re.compile(chinese)}


_TURNS = _words(
    r"\b(?:not|no|never|without|nearly|almost|nor|neither|nothing|none|hardly|instead|than|like|would"
    r"|could|might|should|must|will|can|let|want|try|tried|before|until|when|while|after|if|to (?:be|get"
    r"|take|hold)|need|needs|about to|going to|ready|empty|other|another|else|yet|used to|looking for"
    r"|once|free|back|put|place|drop|far from|out of)\b|n't\b|'ll\b|\?",
    r"没|不|未|别|无|非|差点|几乎|本来|要(?!命)|会(?!儿)|能|该|想|让|等|如果|的话|之前|以前|时候|时|再|空|准备|打算|去|另|比|像|(?<![刚方])才|就行|吗|呢|只有|哪|什么",
)
"""Words that may turn the sense of a clause."""
_HAND = _words(
    r"\b(?:in|between|within) (?:my|one|both) (?:[a-z]+ )?(?:hands?|fingers|grip|palms?|fist|grasp"
    r"|gripper|arms|clutches)\b|\b(?:hand|hands|arms) (?:(?:is|are) (?:busy|occupied|full|taken)|hold)"
    r"|\bcom(?:e|ing) away with\b|\b(?:i|it|hand|fingers|gripper)(?:'m| am| is| are)?(?: [a-z]+ly| still"
    r"| now| already)* (?:hold|holds|holding|carry|carrying|clutch|clutching|grip|gripping|cradle"
    r"|cradling|grasping|wield|wielding)\b|\bpocketed\b",
    r"(?:手|掌|怀)(?:里|上|中|心)(?:正|还|已经|现在|此刻|仍|一直|稳稳|紧紧|牢牢|地|我)*"
    r"(?:[拿握攥举抓捏捧抱提端拎托夹]|是|有)|(?:被我|我)(?:已经|正|稳稳|紧紧|牢牢|地|早)*"
    r"[拿握攥抓捏捧抱拎托](?:着|稳|牢|紧|在手)|[拿握攥抓捏捧抱拎托]在(?:我)?(?:的)?(?:手|掌|怀)",
)
_TAKEN = _words(
    r"\b(?:picked|took|taken|grabbed|got|gotten|fetched|collected|retrieved|snatched|scooped|seized"
    r"|lifted|plucked|pocketed|secured|bagged|nabbed)\b|\bup (?:it|they) (?:went|came)\b|\bcame (?:up|away)\b",
    r"(?:拿|取|捡|抓|拾|拎|端|捞|掏|抽|摸|揣|夹)(?:[^，。；§]{0,4})?(?:了|过|到|起|走|出|下来|上来)|到手|入手|拿下|一[拿抓取捡够]就",
)
_SELF = _words(
    r"\b(?:i|i've|i'd|my|me)\b",
    r"我|亲手|已经|刚才|刚刚|早就|方才",
)
_EASE = _words(
    r"\bwithout (?:any |a |the slightest |much )?(?:trouble|problem|hitch|fuss|effort|difficulty|resistance"
    r"|ado|struggle|snag)\b|\b(?:first|one) (?:try|attempt|go|grab|shot)\b|\beas(?:y|ily)\b"
    r"|\beffortless(?:ly)?\b|\bno (?:trouble|problem|fuss|effort)\b|\bup it went\b|\bsmoothly\b"
    r"|\bstraight away\b|\bright away\b|\bat once\b|\bin one go\b|\ba breeze\b|\bsuccessfully\b"
    r"|\b(?:went|came) (?:fine|well|up nicely|up at once)\b|\bwillingly\b",
    r"一(?:试|拿|抓|伸手|次|下子?|把|够|碰|取|捡)就|试(?:过|了)?一次就|顺利|顺顺当当|轻松|轻而易举|毫不费力|没费|一次成功|很容易|乖乖|痛快",
)
_LIES = _words(
    r"\b(?:fallen|fell|rolled|slid|found (?:its|their) way|made it|made their way|ended up|landed|come to rest"
    r"|(?:is|are)(?: [a-z]+){0,3}|it's(?: [a-z]+){0,2}|§'s(?: [a-z]+){0,2}|lies|lie|sits|sit|stands|stand|rests|rest|spread|spreads"
    r"|perched|balanced|tucked|placed|lying|sitting|standing|resting|waits|hangs|leans|nestles|dangles|perches"
    r"|lounges|sprawls|stays|lives|basks|soaks|floats|drapes)(?: [a-z]+(?<!of)(?<!off)){0,2} (?:on|in|into|onto|inside|to|upon|atop|on top of)"
    r" (?:the (?:edge|rim|top|side|corner|surface|bottom|middle) of )?(?:(?:the|that|this|my|its|a) )?(?:[a-z]+ ){0,2}$",
    r"^(?:[\u4e00-\u9fff]{0,8})(?:[放摆躺搁挂立铺架靠插堆叠晾搭待留落丢塞滚掉浸泡晒睡坐压贴码斜]|就|正|还|也|则|都|是|明明)(?:着)?[在到进](?:了)?(?:那|这|那边|这边|旁边|左边|右边)?(?:[一张个只块台的]{0,3})$",
)
_ON_IT = _words(r"^(?!'s|')", r"^(?:的)?(?:[一]?角)?(?:边缘|边沿|上面|里面|里头|上|里|中|内)")


def _plain(thought: Thought, clause: Clause) -> bool:
    """Whether a clause tells what is or was, and nothing turns it."""
    language = thought.known.language
    return not (
        clause.guessed or clause.negated or clause.wanted or clause.intended
    ) and not _TURNS[language].search(clause.text)


def judge_hand_loosely(thought: Thought) -> Iterator[Verdict]:
    """One thing is named with a word for the hand that holds it."""
    held, language = thought.known.held, thought.known.language
    truth = f"the agent holds {held}" if held else "the hand is empty"
    for clause, span in clauses_of(thought):
        hand = _HAND[language].search(clause.text)
        if not hand or len(span.mentions) != 1 or clause.past or not _plain(thought, clause):
            continue
        mention = span.mentions[0]
        if "放" in clause.text:
            continue
        named = hand.end() == span.places[0] and language == "zh"
        if not (named or _portable(mention)) or mention.types & thought.held:
            continue
        refusal = Refusal("held", f"{name_of(mention)} is not in the hand: {truth}.")
        yield Verdict(span.sentence, refusal)


def judge_ease(thought: Thought) -> Iterator[Verdict]:
    """A thing was taken easily, although the first attempt failed or none was made."""
    language = thought.known.language
    spans = [*sentences_of(thought), *(span for _, span in clauses_of(thought))]
    for span in spans:
        if any(each.guessed or each.wanted for each in span.clauses):
            continue
        ease, taken = _EASE[language].search(span.text), _TAKEN[language].search(span.text)
        if not ease or not taken or len(span.mentions) > 2:
            continue
        mention = next((each for each in span.mentions if _portable(each)), None)
        if mention is None or _TURNS[language].search(
            span.text.replace(ease.group(), " ").replace(taken.group(), " ")
        ):
            continue
        tries = _tries(thought, mention)
        if tries and not tries[0]:
            detail = f"The first attempt to take {name_of(mention)} failed."
            yield Verdict(span.sentence, Refusal("history", detail))


def judge_taken(thought: Thought) -> Iterator[Verdict]:
    """The agent took a thing."""
    language = thought.known.language
    for clause, span in clauses_of(thought):
        taken = _TAKEN[language].search(clause.text)
        if not taken or not _SELF[language].search(clause.text) or not _plain(thought, clause):
            continue
        portable = [each for each in span.mentions if _portable(each)]
        if len(portable) != 1 or len(span.mentions) > 3 or (clause.past and language == "en"):
            continue
        if language == "en" and not re.match(
            rf".*?\bi(?:'ve| have)? (?:[a-z]+ly |just |already |also )*{taken.group()}(?: up| hold of| out| away)?"
            rf" (?:the |a |that |this |my |one |an )?(?:[a-z]+ )?{MARK}",
            clause.text,
        ):
            continue
        if not has_done(thought, verbs.PICKUP, portable[0]):
            detail = f"The agent did not pick up {name_of(portable[0])} before."
            yield Verdict(span.sentence, Refusal("history", detail))


def judge_lies_loosely(thought: Thought) -> Iterator[Verdict]:
    """A thing that can be carried is on another: the first name, a verb, a preposition, the second."""
    language = thought.known.language
    for clause, span in clauses_of(thought):
        if len(span.mentions) < 2 or clause.past or not clause.is_fact or clause.wanted:
            continue
        for k in range(len(span.mentions) - 1):
            thing, holder = span.mentions[k : k + 2]
            begin, end = span.places[k] + 1, span.places[k + 1]
            between = (MARK if language == "en" else "") + span.text[begin:end]
            if not _portable(thing) or "receptacle" not in _properties(holder):
                continue
            if not _LIES[language].search(between) or _TURNS[language].search(between):
                continue
            if not _ON_IT[language].search(span.text[end + 1 :]):
                continue
            if (k and _joins(span, k)) or is_placing(clause, begin - 1, thought.phrases):
                continue
            if thought.phrases.of_other.search(span.text[: begin - 1]):
                continue
            wrong = not_on(thought, thing, holder)
            if wrong:
                detail = f"{name_of(thing)} is not in or on {name_of(holder)}: {wrong}."
                yield Verdict(span.sentence, Refusal("support", detail))


def _joins(span: Span, k: int) -> bool:
    """Whether a name is but a further one, such as "the mug on the desk is in the sink"."""
    return bool(
        re.search(
            r"\b(?:on|in|by|near|from|of|at|beside)\b|[在从]",
            span.text[span.places[k - 1] + 1 : span.places[k]],
        )
    )


_SENT = _words(
    r"\b(?:sent(?: me| here| out)? for|sent to (?:get|fetch|find)|(?:task|job|errand|order|mission|instruction)s? (?:wants|asks for|calls for|is about|demands|concerns)(?: first)?(?: is)?"
    r"|(?:what|all) (?:the task|they|i) (?:want|wants|was asked for|am asked for|need|needs)(?: first)? is|(?:i'm|i am) here for)\b",
    r"(?:任务|题目|指令)(?:里)?(?:真正|首先|只|先)?(?:要的|要找的|想要的|的第一步|的目标)(?:东西)?(?:只)?(?:是|就是)(?:去|先|要)?(?:把|将)?|(?:要我|叫我|让我)(?:去)?(?:找|拿|取)的(?:是|就是)",
)


def judge_wanted(thought: Thought) -> Iterator[Verdict]:
    """The task wants a thing."""
    known = thought.known
    asked = all_interchangeable((*named_in(known.instruction), *_own(thought)))
    for span in sentences_of(thought):
        match = _SENT[known.language].search(span.text)
        if not match or lexicon_of(thought).undone.search(span.text[: match.end() + 25]):
            continue
        if any(each.conditional or each.hedged for each in span.clauses):
            continue
        mention = span.first(match.end(), match.end() + 25)
        first = _first_named(known.instruction)
        ordered = first and mention is not None and _FIRST.search(match.group())
        late = ordered and _portable(mention) and not mention.types & first
        if mention is not None and (late or not mention.types & asked):
            detail = f"The task says: “{known.instruction}”; do not say otherwise."
            yield Verdict(span.sentence, Refusal("task", detail))


_FIRST = re.compile(r"\bfirst\b|第一|首先")
_REORDERS = re.compile(r"\b(?:before|after)\b|之前|以前|之后|以后", re.IGNORECASE)


def _first_named(instruction: str) -> frozenset[str]:
    """What an instruction names first, unless it may tell its jobs in another order."""
    named = find_mentions(instruction)
    if not named or _REORDERS.search(instruction):
        return frozenset()
    return all_interchangeable(named[0].types)


_QUOTED = re.compile(r"[\"“「『‘']([^\"”」』’]{4,120})[\"”」』’']")
_ANSWERED = _words(
    r"\b(?:said|told|says|answer|message|reply|replied|feedback|system|response|it)\b|^[\"“]you can",
    r"提示|系统|反馈|回复|回答|消息|说",
)
_REFUSES = _words(
    r"\b(?:cannot|can't|not|no|none|unable|failed|jammed|locked|stuck|denied|refused|too)\b",
    r"无法|不能|没有|不|未|失败|上锁|锁|太|拒绝",
)


def judge_quotes(thought: Thought) -> Iterator[Verdict]:
    """An answer of the engine is quoted: a refusal, to what never failed."""
    known = thought.known
    for quote in _QUOTED.finditer(thought.text):
        words = quote[1].lower()
        before = thought.text[max(0, quote.start() - 60) : quote.start()].lower()
        own = known.language == "en" and words.startswith("you can")
        if not (own or _ANSWERED[known.language].search(before)):
            continue
        if not known.actions or not _REFUSES[known.language].search(words):
            continue
        near = [each for each in thought.clauses if each.mentions]
        types = all_interchangeable(
            name for each in near[:2] for mention in each.mentions[:1] for name in mention.types
        )
        meant = [each for each in known.actions if each.action.object_type in types]
        if meant and all(each.success for each in meant):
            last = meant[-1]
            detail = f"The answer to {last.action} was: {last.feedback.split('.')[0]}."
            yield Verdict(near[0].sentence, Refusal("history", detail))


def _own(thought: Thought) -> list[str]:
    goal = thought.known.subgoal
    return [each for each in (goal.thing, goal.place) if each in OBJECT_TYPES]


def _properties(mention: Mention) -> frozenset[str]:
    return frozenset(one for each in mention.types for one in OBJECT_TYPES[each].properties)


def _portable(mention: Mention) -> bool:
    return all("pickupable" in OBJECT_TYPES[each].properties for each in mention.types)


def _tries(thought: Thought, mention: Mention) -> list[bool]:
    wanted = all_interchangeable(mention.types)
    return [
        each.success
        for each in thought.known.actions
        if each.action.verb == verbs.PICKUP and each.action.object_type in wanted
    ]
