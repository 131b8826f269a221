"""What servers say when they refuse one conversation and answer others, in their own words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Refused:
    """A refusal of one conversation.

    Attributes:
        kind: what is wrong with it, as :mod:`agents.vlm.clients.failures` names it.
        status, words, code: of the answer.
    """

    kind: str
    status: int
    words: str
    code: str | int | None = None

    @property
    def body(self) -> dict[str, Any]:
        """The answer, in OpenAI's form."""
        return {"error": {"message": self.words, "code": self.code}}


REFUSALS: list[Refused] = [
    Refused("context", 400, "maximum context length is 10 tokens", "context_length_exceeded"),
    Refused("context", 400, "This model's maximum context length is 2048 tokens. However, you requested 2100 tokens (1076 in the messages, 1024 in the completion). Please reduce the length of the messages or completion.", 400),
    Refused("context", 400, "'max_tokens' or 'max_completion_tokens' is too large: 1024. This model's maximum context length is 4096 tokens and your request has 3500 input tokens", 400),
    Refused("context", 400, "The decoder prompt (length 9) is longer than the maximum model length of 8. Make sure that `max_model_len` is no smaller than the number of text tokens plus multimodal tokens.", 400),
    Refused("context", 400, "You passed 4097 input tokens and requested 1024 output tokens. However, the model's context length is only 4096 tokens"),
    Refused("context", 400, "The input (5000 tokens) is longer than the model's context length (4096 tokens)."),
    Refused("context", 400, "Requested token count exceeds the model's maximum context length of 4096 tokens."),
    Refused("context", 400, "the request exceeds the available context size", "exceed_context_size_error"),
    Refused("context", 500, "the request exceeds the available context size. try increasing the context size"),
    Refused("context", 400, "Trying to keep the first 5000 tokens when context the overflows. However, the model is loaded with context length of only 4096 tokens"),
    Refused("context", 422, "Input validation error: `inputs` tokens + `max_new_tokens` must be <= 4096. Given: 5000 `inputs` tokens and 1024 `max_new_tokens`"),
    Refused("context", 400, "prompt is too long: 210000 tokens > 200000 maximum"),
    Refused("context", 400, "input length and `max_tokens` exceed context limit: 190000 + 20000 > 200000"),
    Refused("context", 400, "The input token count (1200000) exceeds the maximum number of tokens allowed (1048576)."),
    Refused("context", 400, "Prompt contains 40000 tokens and 0 draft tokens, too large for model with 32768 maximum context length"),
    Refused("context", 400, "Range of input length should be [1, 30720]", "InvalidParameter"),
    Refused("context", 400, "Invalid request: Your request exceeded model token limit: 8192"),
    Refused("context", 400, "Prompt 超长", "1261"),
    Refused("context", 400, "输入过长，超过模型最大长度限制"),
    Refused("context", 413, "Request Entity Too Large"),
    Refused("context", 413, "no", "request_too_large"),
    Refused("context", 429, "Request too large for gpt-4o on tokens per min (TPM): Limit 30000, Requested 35000.", "rate_limit_exceeded"),
    Refused("pictures", 400, "At most 4 image(s) may be provided in one request."),
    Refused("pictures", 400, "At most 4 image(s) may be provided in one prompt."),
    Refused("pictures", 400, "You set image=4 (or defaulted to 1) in `--limit-mm-per-prompt`, but found 5 items in the same prompt."),
    Refused("pictures", 400, "messages.0.content: too many images: 101 > 100"),
    Refused("pictures", 400, "Too many images in request. Max is 50."),
    Refused("pictures", 400, "Exceeded maximum number of images (8)"),
    Refused("pictures", 400, "Image count exceeded the maximum of 8"),
    Refused("pictures", 400, "This model supports up to 5 images"),
    Refused("pictures", 400, "图片数量超过上限"),
    Refused("content", 400, "The response was filtered", "content_filter"),
    Refused("content", 400, "The response was filtered due to the prompt triggering Azure OpenAI's content management policy."),
    Refused("content", 400, "Input data may contain inappropriate content.", "data_inspection_failed"),
    Refused("content", 400, "The request was rejected because it was considered high risk"),
    Refused("content", 400, "系统检测到输入或生成内容可能包含不安全或敏感内容", "1301"),
    Refused("content", 403, "Your chosen model requires moderation and your input was flagged"),
]  # fmt: skip
