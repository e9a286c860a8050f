"""`gnss-hil completion`: what a shell completes, made from the parsers of all commands."""

from __future__ import annotations

import argparse
from argparse import Namespace

SHELLS = ("bash", "zsh", "fish")

_DESCRIPTION = """\
Writes a script that makes a shell complete commands, options and what they take. For good:
  bash   gnss-hil completion bash > ~/.local/share/bash-completion/completions/gnss-hil
  zsh    source <(gnss-hil completion zsh), in ~/.zshrc
  fish   gnss-hil completion fish > ~/.config/fish/completions/gnss-hil.fish
or for this shell: source <(gnss-hil completion bash)"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.description = _DESCRIPTION
    parser.add_argument("shell", choices=SHELLS, metavar="|".join(SHELLS), help="whose script")


def run(arguments: Namespace) -> int:
    from gnss_hil.tools.command_line import completion

    print(completion.script(arguments.shell), end="")
    return 0
