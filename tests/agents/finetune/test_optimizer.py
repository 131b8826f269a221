"""Muon and AdamW as one optimizer."""

from __future__ import annotations

from copy import deepcopy

import pytest
import torch

from agents.finetune.optimizer import MuonAdamW


class Network(torch.nn.Module):
    def __init__(self) -> None:
        super().__init__()
        torch.manual_seed(0)
        self.embedding = torch.nn.Embedding(7, 6)
        self.layers = torch.nn.ModuleList([torch.nn.Linear(6, 6), torch.nn.Linear(6, 4)])
        self.head = torch.nn.Linear(4, 7, bias=False)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        hidden = self.embedding(x)
        for layer in self.layers:
            hidden = torch.tanh(layer(hidden))
        return self.head(hidden)


def learn(network: Network, optimizers: list[torch.optim.Optimizer], rates: list[float]) -> None:
    x = torch.arange(7)
    for rate in rates:
        torch.nn.functional.cross_entropy(network(x), x.flip(0)).backward()
        for each in optimizers:
            for group in each.param_groups:
                group["lr"] = rate
            each.step()
        network.zero_grad()


def weights(network: Network) -> list[list[float]]:
    return [weight.flatten().tolist() for weight in network.parameters()]


def test_matrices_of_layers_learn_by_muon_and_all_else_by_adamw() -> None:
    one, two = Network(), Network()
    matrices = [layer.weight for layer in two.layers]
    vectors = [layer.bias for layer in two.layers]
    rest = [two.embedding.weight, two.head.weight]
    apart = [
        torch.optim.Muon(matrices, weight_decay=0.3, adjust_lr_fn="match_rms_adamw"),
        torch.optim.AdamW(rest, weight_decay=0.3),
        torch.optim.AdamW(vectors, weight_decay=0.0),
    ]
    rates = [0.1, 0.05, 0.02]
    learn(one, [MuonAdamW(one, 1.0, weight_decay=0.3)], rates)
    learn(two, apart, rates)
    for found, wanted in zip(weights(one), weights(two), strict=True):
        assert found == pytest.approx(wanted, rel=1e-6)


def test_it_goes_on_from_its_state() -> None:
    whole, half = Network(), Network()
    learn(whole, [MuonAdamW(whole, 0.1, weight_decay=0.0)], [0.1] * 5)
    first = MuonAdamW(half, 0.1, weight_decay=0.0)
    learn(half, [first], [0.1] * 3)
    then = MuonAdamW(half, 0.1, weight_decay=0.0)
    then.load_state_dict(deepcopy(first.state_dict()))
    learn(half, [then], [0.1] * 2)
    assert weights(half) == weights(whole)


def test_a_scheduler_sets_the_rate_of_every_group_and_frozen_weights_stay() -> None:
    network = Network()
    network.embedding.weight.requires_grad_(False)
    network.layers[0].weight.requires_grad_(False)
    frozen = [network.embedding.weight.tolist(), network.layers[0].weight.tolist()]
    optimizer = MuonAdamW(network, 0.1, weight_decay=0.1)
    schedule = torch.optim.lr_scheduler.LambdaLR(optimizer, lambda step: 1 / (1 + step))
    learn(network, [optimizer], [0.1])
    schedule.step()
    assert [group["lr"] for group in optimizer.param_groups] == [0.05] * 3
    assert frozen == [network.embedding.weight.tolist(), network.layers[0].weight.tolist()]
