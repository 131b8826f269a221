"""The words by which :mod:`er_gym.data.clauses.loose` reads clauses, by language."""

from __future__ import annotations

import re
from collections.abc import Mapping

from er_gym.data.clauses.lexicon import Words
from er_gym.data.trajectory import Language

ByLanguage = Mapping[Language, Words]


def _words(english: str, chinese: str) -> ByLanguage:
    return {"en": re.compile(english), "zh": re.compile(chinese)}


TURNS = _words(
    r"\b(?:not|no|never|without|nearly|almost|nor|neither|nothing|none|hardly|instead|than|like|would"
    r"|could|might|should|must|will|can|let|want|try|tried|before|until|when|while|after|if|to (?:be|get"
    r"|take|hold)|need|needs|about to|going to|ready|empty|other|another|else|yet|used to|looking for"
    r"|once|free|back|put|place|drop|far from|out of)\b|n't\b|'ll\b|\?",
    r"没|不|未|别|无|非|差点|几乎|本来|要(?!命)|会(?!儿)|能|该|想|让|等|如果|的话|之前|以前|时候|时|再|空|准备|打算|去|另|比|像|(?<![刚方])才|就行|吗|呢|只有|哪|什么",
)
"""Words that may turn the sense of a clause."""
HAND = _words(
    r"\b(?:in|between|within) (?:my|one|both) (?:[a-z]+ )?(?:hands?|fingers|grip|palms?|fist|grasp"
    r"|gripper|arms|clutches)\b|\b(?:hand|hands|arms) (?:(?:is|are) (?:busy|occupied|full|taken)|hold)"
    r"|\bcom(?:e|ing) away with\b|\b(?:i|it|hand|fingers|gripper)(?:'m| am| is| are)?(?: [a-z]+ly| still"
    r"| now| already)* (?:hold|holds|holding|carry|carrying|clutch|clutching|grip|gripping|cradle"
    r"|cradling|grasping|wield|wielding)\b|\bpocketed\b",
    r"(?:手|掌|怀)(?:里|上|中|心)(?:这|那)(?:[个只张把台块条本支])|一手(?=§)|(?:手|掌|怀)(?:里|上|中|心)(?:正|还|已经|现在|此刻|仍|一直|稳稳|紧紧|牢牢|地|我)*"
    r"(?:[拿握攥举抓捏捧抱提端拎托夹]|是|有)|(?:被我|我)(?:已经|正|稳稳|紧紧|牢牢|地|早)*"
    r"[拿握攥抓捏捧抱拎托](?:着|稳|牢|紧|在手)|[拿握攥抓捏捧抱拎托]在(?:我)?(?:的)?(?:手|掌|怀)",
)
TAKEN = _words(
    r"\b(?:picked|took|taken|grabbed|got|gotten|fetched|collected|retrieved|snatched|scooped|seized"
    r"|lifted|plucked|pocketed|secured|bagged|nabbed|mine|gave in|yielded|obliged|surrendered|let (?:itself|themselves) be (?:taken|picked up|lifted)|jumped into|came to hand|came quietly)\b|\bup (?:it|they) (?:went|came)\b|\bcame (?:up|away)\b",
    r"(?:拿|取|捡|抓|拾|拎|端|捞|掏|抽|摸|揣|夹)(?:[^，。；§]{0,4})?(?:了|过|到|起|走|出|下来|上来)|到手|入手|拿下|一[拿抓取捡够]就",
)
SELF = _words(
    r"\b(?:i|i've|i'd|my|me)\b",
    r"我|亲手|已经|刚才|刚刚|早就|方才",
)
OVER = re.compile(r"[了过]|亲手|已经|早就|刚才|出来的")
"""Chinese: a deed is over."""
EASE = _words(
    r"\bwithout (?:any |a |the slightest |much )?(?:trouble|problem|hitch|fuss|effort|difficulty|resistance"
    r"|ado|struggle|snag)\b|\b(?:first|one) (?:try|attempt|go|grab|shot)\b|\beas(?:y|ily)\b"
    r"|\beffortless(?:ly)?\b|\bno (?:trouble|problem|fuss|effort)\b|\bup it went\b|\bsmoothly\b"
    r"|\bstraight away\b|\bright away\b|\bat once\b|\bin one go\b|\ba breeze\b|\bsuccessfully\b"
    r"|\b(?:went|came) (?:fine|well|up nicely|up at once)\b|\bwillingly\b",
    r"一(?:试|拿|抓|伸手|次|下子?|把|够|碰|取|捡)就|试(?:过|了)?一次就|顺利|顺顺当当|轻松|轻而易举|毫不费力|没费|一次成功|很容易|乖乖|痛快",
)
LIES = _words(
    r"\b(?:fallen|fell|rolled|slid|found (?:its|their) way|made it|made their way|ended up|landed|come to rest"
    r"|(?:is|are)(?: [a-z]+){0,3}|it's(?: [a-z]+){0,2}|§'s(?: [a-z]+){0,2}|lies|lie|sits|sit|stands|stand|rests|rest|spread|spreads"
    r"|perched|balanced|tucked|placed|lying|sitting|standing|resting|waits|hangs|leans|nestles|dangles|perches"
    r"|lounges|sprawls|stays|lives|basks|soaks|floats|drapes)(?: [a-z]+(?<!of)(?<!off)){0,2} (?:on|in|into|onto|inside|to|upon|atop|on top of)"
    r" (?:the (?:edge|rim|top|side|corner|surface|bottom|middle) of )?(?:(?:the|that|this|my|its|a) )?(?:[a-z]+ ){0,2}$",
    r"^(?:[\u4e00-\u9fff]{0,8})(?:[放摆躺搁挂立铺架靠插堆叠晾搭待留落丢塞滚掉浸泡晒睡坐压贴码斜]|就|正|还|也|则|都|是|明明)(?:着)?[在到进](?:了)?(?:那|这|那边|这边|旁边|左边|右边)?(?:[一张个只块台的]{0,3})$",
)
ON_IT = _words(r"^(?!'s|')", r"^(?:的)?(?:[一]?角)?(?:边缘|边沿|上面|里面|里头|上|里|中|内)")
SENT = _words(
    r"\b(?:sent(?: me| here| out)? for|sent to (?:get|fetch|find)|(?:task|job|errand|order|mission|instruction)s? (?:wants|asks for|calls for|is about|demands|concerns)(?: first)?(?: is)?"
    r"|(?:what|all) (?:the task|they|i) (?:want|wants|was asked for|am asked for|need|needs)(?: first)? is|(?:i'm|i am) here for)\b",
    r"(?:任务|题目|指令)(?:里)?(?:真正|首先|只|先)?(?:要的|要找的|想要的|的第一步|的目标)(?:东西)?(?:只)?(?:是|就是)(?:去|先|要)?(?:把|将)?|(?:要我|叫我|让我)(?:去)?(?:找|拿|取)的(?:是|就是)",
)
FIRST = re.compile(r"\bfirst\b|第一|首先")
REORDERS = re.compile(r"\b(?:before|after)\b|之前|以前|之后|以后", re.IGNORECASE)
QUOTED = re.compile(
    r"[\"“「『]([^\"”」』]{4,120})[\"”」』]|(?<![a-z])[‘']([^\"’']{4,120})[’'](?![a-z])",
    re.IGNORECASE,
)
ANSWERED = _words(
    r"\b(?:said|told|says|answer|message|reply|replied|feedback|system|response|it)\b|^[\"“]you can",
    r"提示|系统|反馈|回复|回答|消息|说",
)
ANSWERED_AFTER = _words(
    r"^[.,!]?[\"”]?,? ?(?:came|was|is|that's|that is|it|the|said|says|they|i was told|so|:|read|read back|they say|according)?[^.;]{0,25}\b(?:said|says|answer|message|reply|replied|feedback|system|response|objected|told|protested|read|came back|verdict|complained|insisted)\b",
    r"^[，。]?(?:这是|是|系统|它|就是)?[^。]{0,10}(?:提示|系统|反馈|回复|回答|消息|说|报错|答复)",
)
KINDS_OF_ANSWERS = (
    re.compile(
        r"already hold|hold [^.]{0,20}already|hand(?:s)? (?:is|are) (?:already )?full|put it down first|手里已经拿|手里已有|手里拿着|先放下"
    ),
    re.compile(r"within reach|close enough|too far|out of reach|够得着|够不|太远|足够近"),
    re.compile(r"hand is empty|hands are empty|nothing in (?:my|your) hand|手里是空|手是空|两手空"),
    re.compile(
        r"names no action|no such action|unknown (?:action|command)|invalid|not an action|不是一个动作|无效|未知动作"
    ),
)
"""Kinds of the engine's answers, in both languages: one that was never given cannot be quoted."""
REFUSES = _words(
    r"\b(?:cannot|can't|not|no|none|unable|failed|jammed|locked|stuck|denied|refused|too)\b",
    r"无法|不能|没有|不|未|失败|上锁|锁|太|拒绝",
)
