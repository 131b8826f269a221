"""Chinese instructions. The fields of the templates:

- {object}: a name, or a name with its place (书桌上的书);
- {room}: the room's kind; {way}: 打开 or 关掉; {place}: 冰箱里, 搁架上;
- {second_object}, {second_place}: those of the second transfer.
"""

from __future__ import annotations

from er_gym.tasks.wordings.grammar import Grammar, Joiner, Parts, Sentences

_FRAMES = Parts(
    seen=(
        "{core}。",
        "请{core}。",
        "请你{core}。",
        "麻烦你{core}。",
        "你能{core}吗？",
        "可以{core}吗？",
        "帮我{core}。",
        "请帮我{core}。",
        "帮忙{core}，谢谢。",
        "我需要你{core}。",
        "我想让你{core}。",
        "你的任务是{core}。",
        "有空的话，请{core}。",
        "有件事要做：{core}。",
        "劳驾{core}。",
        "家里要来客人，请{core}。",
        "我现在很忙，请你{core}。",
        "能不能{core}？",
        "{core}，好吗？",
        "机器人，{core}。",
    ),
    unseen=(
        "烦请{core}。",
        "拜托你{core}。",
        "不知道你能不能{core}？",
        "今天的家务是：{core}。",
        "我腿脚不便，想请你{core}。",
    ),
)

_FIND = Sentences(
    whole=Parts((), ()),
    cores=Parts(
        seen=(
            "找到{room}里的{object}",
            "在{room}里找到{object}",
            "在这个{room}里找一找{object}",
            "在{room}里找{object}，看到为止",
            "找出{object}在{room}的什么地方",
            "到处看看，找到{object}",
            "看看{object}在{room}的哪里",
            "搜索{room}，直到看见{object}",
            "在{room}里四处走走，找到{object}",
            "找一下{object}",
        ),
        unseen=("在{room}里搜寻{object}", "寻找这个{room}里的{object}"),
    ),
)

_PICK_UP = Sentences(
    whole=Parts((), ()),
    cores=Parts(
        seen=(
            "拿起{object}",
            "拿起{room}里的{object}",
            "找到{object}并拿起来",
            "把{object}拿在手里",
            "去拿{object}，拿在手里",
            "在{room}里找到{object}，把它拿起来",
            "找{object}，拿在手上",
            "取来{object}，拿在手里",
            "把{object}拿起来",
            "把{room}里的{object}拿起来",
        ),
        unseen=("捡起{object}", "取{object}，握在手中"),
    ),
)

_TOGGLE = Sentences(
    whole=Parts((), ()),
    cores=Parts(
        seen=(
            "{way}{object}",
            "{way}{room}里的{object}",
            "把{object}{way}",
            "找到{object}，把它{way}",
            "走到{object}那里，把它{way}",
            "去把{object}{way}",
            "在{room}里找到{object}，把它{way}",
            "过去{way}{object}",
            "把{room}里的{object}{way}",
        ),
        unseen=("负责把{object}{way}", "到{object}跟前{way}它"),
    ),
)

_MOVE = Sentences(
    whole=Parts((), ()),
    cores=Parts(
        seen=(
            "把{object}放到{place}",
            "把{object}放在{place}",
            "拿起{object}，放到{place}",
            "去拿{object}，把它放到{place}",
            "找到{object}，把它放在{place}",
            "取{object}，放到{place}",
            "在{room}里找到{object}，放到{place}",
            "把{object}拿过去，放在{place}",
            "将{object}放到{place}",
            "将{room}里的{object}放到{place}",
        ),
        unseen=("将{object}搁到{place}", "把{object}摆到{place}"),
    ),
)

_MOVE_TWO = Sentences(
    whole=Parts((), ()),
    cores=Parts(
        seen=(
            "先把{object}放到{place}，再把{second_object}放到{second_place}",
            "把{object}放到{place}，然后把{second_object}放到{second_place}",
            "首先把{object}放到{place}，之后把{second_object}放到{second_place}",
            "先拿{object}放到{place}，然后拿{second_object}放到{second_place}",
            "先找到{object}，放到{place}，再找到{second_object}，放到{second_place}",
            "把{object}放在{place}以后，再把{second_object}放在{second_place}",
            "先将{object}放到{place}，接着将{second_object}放到{second_place}",
            "先去拿{object}，放在{place}，再去拿{second_object}，放在{second_place}",
        ),
        unseen=(
            "先把{object}摆到{place}，随后把{second_object}摆到{second_place}",
            "先把{object}搁到{place}，随后再把{second_object}搁到{second_place}",
        ),
    ),
)

_JOINERS = Parts(
    seen=(
        Joiner("先{clause}", ("，再{clause}", "，然后{clause}"), "，最后{clause}"),
        Joiner("{clause}", ("，然后{clause}", "，接着{clause}"), "，最后{clause}"),
        Joiner("首先{clause}", ("；接着{clause}", "；然后{clause}"), "；最后{clause}"),
    ),
    unseen=(
        Joiner(
            "第一步先{clause}", ("；下一步，{clause}", "；然后{clause}"), "；最后一步，{clause}"
        ),
    ),
)

_VERBS = {
    "put": Parts(("把{0}放到{1}", "将{0}放到{1}"), ("把{0}摆到{1}",)),
    "turn on": Parts(("打开{0}", "把{0}打开"), ()),
    "turn off": Parts(("关掉{0}", "把{0}关掉"), ()),
    "wash": Parts(("把{0}放进{1}，用{2}的水洗干净",), ("将{0}放进{1}，用{2}的水冲洗干净",)),
    "fill": Parts(("把{0}放进{1}，用{2}的水装满",), ("将{0}放进{1}，用{2}的水灌满",)),
    "brew": Parts(("给{0}倒满{1}里的咖啡", "给{0}装满{1}里的咖啡"), ()),
    "toast": Parts(("把{0}放进{1}烤一烤",), ("将{0}放进{1}烤一烤",)),
    "heat": Parts(("把{0}放进{1}加热，打开再关掉{1}",), ("把{0}放进{1}热一热，打开再关掉{1}",)),
    "cool": Parts(("把{0}放进关着的{1}冷却", "把{0}放进关着的{1}冰一冰"), ()),
    "slice": Parts(("把{0}用{1}切开，把{1}放到{3}", "将{0}用{1}切开，将{1}放到{3}"), ()),
}
"""The clauses of long-range tasks; {3} is the place where a knife is laid down."""

CHINESE = Grammar(
    frames=_FRAMES,
    sentences={
        "find": _FIND,
        "pick up": _PICK_UP,
        "toggle": _TOGGLE,
        "move": _MOVE,
        "move two": _MOVE_TWO,
    },
    styles=Parts((), ()),
    joiners=_JOINERS,
    verbs=_VERBS,
)
"""The Chinese wordings."""

ROOMS = {
    "kitchen": "厨房", "living room": "客厅", "bedroom": "卧室", "bathroom": "浴室",
    "house": "房子",
}  # fmt: skip
WAYS = {"on": "打开", "off": "关掉"}
