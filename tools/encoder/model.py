"""The two halves of the encoder. Both give unit vectors of the same space."""

import torch
import torch.nn as nn
import torch.nn.functional as F

import texts

DIM = 128


def conv(i, o, stride=1):
    return nn.Sequential(nn.Conv2d(i, o, 3, stride, 1, bias=False), nn.BatchNorm2d(o), nn.ReLU())


class Residual(nn.Module):
    def __init__(self, c):
        super().__init__()
        self.a = conv(c, c)

    def forward(self, x):
        return x + self.a(x)


class ImageEncoder(nn.Module):
    """[n, 3, 64, 64] in 0..1 -> [n, DIM]."""

    def __init__(self):
        super().__init__()
        self.body = nn.Sequential(conv(3, 16, 2), conv(16, 48, 2), Residual(48), conv(48, 96, 2), Residual(96),
                                  conv(96, 160, 2), Residual(160))
        self.head = nn.Sequential(nn.Linear(320, 256), nn.ReLU(), nn.Linear(256, DIM))

    def forward(self, tile):
        # Half the side is enough to learn from, at a quarter of the work.
        return self.small(torch.nn.functional.avg_pool2d(tile, 2))

    def small(self, tile):
        """[n, 3, 32, 32], as forward makes it."""
        x = self.body((tile - .2) * 3)
        x = torch.cat([x.mean((2, 3)), x.amax((2, 3))], 1)
        return unit(self.head(x))


class Layer(nn.Module):
    """Self-attention and a small network, normalised before; written out so that it exports plainly."""

    def __init__(self, d, heads=4):
        super().__init__()
        self.heads, self.d = heads, d
        self.n1, self.n2 = nn.LayerNorm(d), nn.LayerNorm(d)
        self.q, self.k, self.v, self.o = (nn.Linear(d, d) for _ in range(4))
        self.up, self.down = nn.Linear(d, 2 * d), nn.Linear(2 * d, d)

    def forward(self, x, bias):
        n, t, d = x.shape
        h = self.n1(x)
        part = lambda m: m(h).reshape(n, t, self.heads, d // self.heads).transpose(1, 2)
        a = part(self.q) @ part(self.k).transpose(2, 3) * (d // self.heads) ** -.5 + bias
        a = (torch.softmax(a, -1) @ part(self.v)).transpose(1, 2).reshape(n, t, d)
        x = x + self.o(a)
        return x + self.down(torch.relu(self.up(self.n2(x))))


class TextEncoder(nn.Module):
    """[n, 16] numbers of words, 0 = none -> [n, DIM]."""

    def __init__(self, d=128):
        super().__init__()
        self.word = nn.Embedding(len(texts.VOCAB) + 1, d)
        self.place = nn.Parameter(torch.randn(texts.TOKENS, d) * .3)
        nn.init.normal_(self.word.weight, std=.5)
        self.layers = nn.ModuleList([Layer(d), Layer(d)])
        self.norm, self.head = nn.LayerNorm(d), nn.Linear(d, DIM)

    def forward(self, tokens):
        real = (tokens > 0).float()
        x = self.word(tokens) + self.place[: tokens.shape[1]]
        bias = ((real - 1) * 1e4)[:, None, None, :]
        for layer in self.layers:
            x = layer(x, bias)
        x = (self.norm(x) * real[:, :, None]).sum(1) / real.sum(1, keepdim=True).clamp(min=1)
        return unit(self.head(x))


def unit(x):
    return x / torch.sqrt((x * x).sum(1, keepdim=True) + 1e-12)


def deviated(whole, part, w=.7):
    """The paper's semantic deviation, normalised again."""
    return F.normalize((1 - w) * whole + w * part, dim=1)
