"""`wsph completion`: a script by which a shell completes commands, options, and names of lists and kinds.

source <(wsph completion bash)          # in ~/.bashrc; zsh in ~/.zshrc
wsph completion fish > ~/.config/fish/completions/wsph.fish
"""

# pyright: strict

import argparse
from collections.abc import Sequence

from wsph.cli.command import Command

BASH = """_wsph() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} words=""
    case ${{COMP_WORDS[1]}} in
{cases}
    esac
    [ $COMP_CWORD -eq 1 ] && words="{commands} --version --help"
    COMPREPLY=($(compgen -W "$words" -- "$word") $(compgen -f -- "$word"))
}}
complete -o filenames -F _wsph wsph
"""

ZSH = "autoload -Uz bashcompinit && bashcompinit\n"


class _Noted(argparse.ArgumentParser):
    """A parser that notes what can be written: options, and choices of arguments."""

    words: list[str]

    def _add_action(self, action: argparse.Action) -> argparse.Action:
        known = self.__dict__.setdefault("words", [])
        known += [flag for flag in action.option_strings if flag.startswith("--")]
        known += [str(choice) for choice in action.choices or () if not action.option_strings]
        return super()._add_action(action)


def _words(command: Command) -> list[str]:
    parser = _Noted()
    command.declare(parser)
    return [*parser.words, *(_listed() if command.name == "list" else [])]


def _listed() -> list[str]:
    from wsph.catalogue import groups
    from wsph.plugins import registry

    plugins = [entry.name for group in registry.GROUPS for entry in registry.entries(group)]
    return [*groups.every(), *plugins]


def script(shell: str, commands: Sequence[Command]) -> str:
    """The script of a shell for some commands."""
    words = {command.name: _words(command) for command in commands}
    if shell == "fish":
        first = "__fish_use_subcommand"
        lines = [f"complete -c wsph -n {first} -a {c.name} -d {_quoted(c.help)}" for c in commands]
        for name, each in words.items():
            seen = f"'__fish_seen_subcommand_from {name}'"
            lines += [f"complete -c wsph -n {seen} {f'-l {w[2:]}' if w.startswith('--') else f'-a {w}'}" for w in each]
        return "\n".join(lines) + "\n"
    cases = "\n".join(f'        {name}) words="{" ".join(each)}" ;;' for name, each in words.items())
    text = BASH.format(cases=cases, commands=" ".join(words))
    return text if shell == "bash" else ZSH + text


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "\\'") + "'"


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=["bash", "zsh", "fish"])


def _act(options: argparse.Namespace) -> int:
    print(script(options.shell, options.commands), end="")
    return 0


COMPLETION = Command("completion", "print a script by which a shell completes commands", _declare, _act)
