"""Completion scripts for shells: words of the parsers, written as each shell wants them."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from gnss_hil.tools.common.errors import PROGRAM


@dataclass(frozen=True, slots=True)
class Argument:
    """What may follow a command: an option, or without names a word of its own.

    names   "--duration"
    help    in one line
    takes   whether a value follows an option
    values  words that it may be;  files  whether it may be a file
    """

    names: tuple[str, ...]
    help: str
    takes: bool
    values: tuple[str, ...]
    files: bool


@dataclass(frozen=True, slots=True)
class Command:
    """A command with its arguments."""

    name: str
    help: str
    arguments: tuple[Argument, ...]

    @property
    def options(self) -> list[Argument]:
        return [argument for argument in self.arguments if argument.names]

    @property
    def words(self) -> list[str]:
        """Values of what stands without an option."""
        return [value for argument in self.arguments if not argument.names for value in argument.values]

    @property
    def files(self) -> bool:
        return any(argument.files for argument in self.arguments if not argument.names)


def _known() -> dict[str, tuple[str, ...]]:
    """Words of arguments that have no choices of their own, because they may be something else too."""
    from gnss_hil.dbc.common import vehicle
    from gnss_hil.emulator.config import scenario
    from gnss_hil.flightsw.assignment.registry import POLICIES
    from gnss_hil.flightsw.estimation.registry import NAVIGATORS

    return {
        "scenario": tuple(scenario.shipped()), "vehicle": tuple(vehicle.shipped()), "policy": tuple(POLICIES),
        "navigator": tuple(NAVIGATORS), "pace": ("lockstep", "realtime", "x10"),
        "bus": ("embedded", "inline", "socketcan"), "part": ("html", "dbc", "hash", "budget"),
        "flight": ("ours", "external"),
        "emulator": ("ours", "external"),
    }  # fmt: skip


def commands() -> list[Command]:
    """Every command as its parser has it."""
    from gnss_hil.tools.command_line.main import COMMANDS, parser_of

    known = _known()
    return [
        Command(c.name, c.help, tuple(_argument(action, known) for action in actions(parser_of(c))))
        for c in COMMANDS.values()
    ]


def actions(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """What a parser takes, and what the parsers of its parts take besides."""
    own = list(parser._actions)
    for action in [*own]:
        if isinstance(action, argparse._SubParsersAction):
            known = {name for taken in own for name in taken.option_strings}
            parts = [more for part in action.choices.values() for more in actions(part)]
            own += [more for more in parts if not known & set(more.option_strings)]
    return own


def _argument(action: argparse.Action, known: Mapping[str, Sequence[str]]) -> Argument:
    values = tuple(map(str, action.choices or known.get(action.dest, ())))
    takes = action.nargs != 0
    files = takes and (action.type is Path or action.dest in ("scenario", "vehicle", "flight", "emulator"))
    words = " ".join((action.help or "").split()).replace("%%", "%")
    return Argument(tuple(action.option_strings), words, takes, values, files)


def script(shell: str) -> str:
    """The script of a shell: bash, zsh or fish."""
    return {"bash": _bash, "zsh": _zsh, "fish": _fish}[shell](commands())


def _bash(found: Sequence[Command]) -> str:
    names = " ".join(command.name for command in found)
    of_options, of_commands = [], []
    for command in found:
        for option in command.options:
            if not option.takes:
                continue
            cases = "|".join(f'"{command.name} {name}"' for name in option.names)
            of_options.append(
                f'        {cases}) choices="{" ".join(option.values)}" files={int(option.files)} ;;'
            )
        words = [*(name for option in command.options for name in option.names), *command.words]
        of_commands.append(_case(command.name, words, command.files))
    lines = "\n".join
    return f"""\
# bash completion of {PROGRAM}, written by: {PROGRAM} completion bash
_gnss_hil() {{
    local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} choices=none files=0
    COMPREPLY=()
    if (( COMP_CWORD == 1 )); then
        COMPREPLY=( $(compgen -W "{names} --help --version" -- "$current") )
        return
    fi
    case "${{COMP_WORDS[1]}} $before" in
{lines(of_options)}
    esac
    [[ $choices != none ]] || case ${{COMP_WORDS[1]}} in
{lines(of_commands)}
        *) choices= ;;
    esac
    COMPREPLY=( $(compgen -W "$choices" -- "$current") )
    if (( files )); then
        local IFS=$'\\n'
        COMPREPLY+=( $(compgen -f -- "$current") )
    fi
}}
complete -o filenames -F _gnss_hil {PROGRAM}
"""


def _case(pattern: str, words: Sequence[str], files: bool) -> str:
    return f'        {pattern}) choices="{" ".join(words)}" files={int(files)} ;;'


def _zsh(found: Sequence[Command]) -> str:
    """zsh reads bash's, by a part of its own."""
    head = f"# zsh completion of {PROGRAM}, written by: {PROGRAM} completion zsh\n"
    begin = "autoload -Uz +X compinit bashcompinit\n(( $+functions[compdef] )) || compinit\nbashcompinit\n"
    return f"{head}{begin}{_bash(found)}"


def _quoted(text: str) -> str:
    """In single quotes, for fish."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def _fish(found: Sequence[Command]) -> str:
    lines = [
        f"# fish completion of {PROGRAM}, written by: {PROGRAM} completion fish",
        f"complete -c {PROGRAM} -f",
    ]
    for command in found:
        first = f"complete -c {PROGRAM} -n __fish_use_subcommand -a {command.name}"
        lines.append(f"{first} -d {_quoted(command.help)}")
    for command in found:
        seen = f"complete -c {PROGRAM} -n '__fish_seen_subcommand_from {command.name}'"
        for option in command.options:
            names = " ".join(f"-l {n[2:]}" if n.startswith("--") else f"-s {n[1:]}" for n in option.names)
            value = " -r" if option.takes else ""
            value += " -F" if option.files else ""
            value += f" -a {_quoted(' '.join(option.values))}" if option.values else ""
            lines.append(f"{seen} {names}{value} -d {_quoted(option.help)}")
        if command.words:
            lines.append(f"{seen} -a {_quoted(' '.join(command.words))}")
        if command.files:
            lines.append(f"{seen} -F")
    return "\n".join(lines) + "\n"
