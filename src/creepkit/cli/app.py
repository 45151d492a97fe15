"""The command `creepkit`: its global options, its commands by stage, and how errors end it.

Exit 0 fine, 1 an error that we can explain in one line, 2 wrong usage, 128 and its number after a signal. A command is
imported when it is asked for; `creepkit --help` imports none.
"""

from __future__ import annotations

import importlib
import inspect
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from creepkit.cli.ending import exit_code_of_signal, interrupted_sentence, say, sentence_of
from creepkit.errors import nearest, printable

STAGES: dict[str, dict[str, str]] = {
    "Begin": {
        "demo": "Run the studies that ship: creep curves, a bulge test.",
        "init": "Write a study file for a folder of data.",
        "run": "Carry out a study, from data to its report.",
    },
    "Data": {
        "read": "Show what measured files hold, and what looks wrong.",
        "extract": "Extract measured histories from camera frames.",
    },
    "Laws": {
        "identify": "Fit laws to creep tests and rank them ('fit' is the same).",
        "discover": "Find forms of temperature for the parameters of a law.",
    },
    "What follows": {
        "predict": "Forecast tests by an identified law.",
        "design": "Say which test to make next.",
        "rupture": "Assess rupture tests by parametric methods.",
        "export": "Write a law with its values as text, or for a solver.",
        "report": "Write results as a page to read, or as a page of sliders.",
    },
    "Simulation": {
        "simulate": "Simulate a test of a bar, a dimple or another specimen.",
        "surrogate": "Data sets, networks and reduced-order models.",
    },
    "Plugins": {
        "list": "List laws, specimens, targets or plugins, or show one in full.",
        "check": "Check that laws, specimens, readers, exporters are fit.",
        "new": "Write a law, specimen, reader or exporter to start from.",
    },
}
"""{stage: {command: the first sentence of its help}}, in the order of work; the module of a command has its name."""


COMMANDS = {name: sentence for stage in STAGES.values() for name, sentence in stage.items()}


ALIASES = {"fit": "identify"}


GOES_ON = "what is finished is kept, and the same command goes on with the rest"
"""Of commands that go on where they were when they are interrupted: run, surrogate, and identify with --by."""


def built(name: str) -> Any:
    """The command of this name, with its options made of the records that it takes."""
    from creepkit.cli.command_options import checked

    module = importlib.import_module(f"creepkit.cli.{name.replace('list', 'listing')}")
    app = typer.Typer(rich_markup_mode=None)
    functions = getattr(module, "COMMANDS", None)
    if functions is None:
        help = f"{COMMANDS[name]}\n\n{inspect.cleandoc(module.command.__doc__)}"
        app.command(name, help=help)(checked(module.command))
    else:
        group = typer.Typer(rich_markup_mode=None, no_args_is_help=True, help=COMMANDS[name])
        for one, function in functions.items():
            group.command(one)(checked(function))
        app.add_typer(group, name=name)
    return typer.main.get_group(app).commands[name]


class CommandGroup(TyperGroup):
    """The group of all commands."""

    def make_context(self, *names: Any, **options: Any) -> Any:
        """Read the command line; `--help` and `--version` print what they are asked for already here."""
        with self._errors_in_one_line("--debug" in sys.argv):
            return super().make_context(*names, **options)

    def invoke(self, ctx: Any) -> Any:
        """Run the command; an error of ours becomes one line on stderr and exit code 1."""
        with self._errors_in_one_line(ctx.params["debug"], ctx):
            if os.environ.get("CREEPKIT_PLUGINS"):
                from creepkit.registry.plugin_sources import check_files_in_environment

                check_files_in_environment()
            _load_plugin_files(ctx.params["plugin"])
            return super().invoke(ctx)

    @contextmanager
    def _errors_in_one_line(self, debug: bool, ctx: Any = None) -> Iterator[None]:
        try:
            yield
        except KeyboardInterrupt as error:
            name = (ctx.invoked_subcommand if ctx is not None else "") or ""
            goes_on = name in ("run", "surrogate") or (
                name == "identify" and any(word.split("=")[0] == "--by" for word in sys.argv)
            )
            say(interrupted_sentence(name, str(error) or GOES_ON * goes_on))
            raise typer.Exit(exit_code_of_signal()) from None
        except Exception as error:
            if debug or _is_of_the_command_line(error) or isinstance(error, BrokenPipeError):
                message = getattr(error, "message", None)  # it names options and arguments as they came
                if isinstance(message, str) and type(error).__name__ != "NoArgsIsHelpError":
                    before = "; write it before the command: creepkit --plugin FILE COMMAND"
                    hint = before if message.startswith("No such option: --plugin") else ""
                    error.message = f"{printable(message)}{hint}"  # type: ignore[attr-defined]
                raise
            for one in getattr(error, "errors", (error,)):
                say(sentence_of(one))
            raise typer.Exit(1) from None

    def list_commands(self, ctx: Any) -> list[str]:
        """The commands, in the order of work."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command of this name; None where there is none."""
        name = ALIASES.get(cmd_name, cmd_name)
        if name in COMMANDS and name not in ctx.meta:  # anew for each command line: options may be those of a plugin
            ctx.meta[name] = built(name)
        return ctx.meta[name] if name in COMMANDS else None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command of the first word; a usage error with the nearest for one that there is not."""
        word = args[0]
        if not word.startswith("-") and self.get_command(ctx, word) is None:
            ctx.fail(f"No such command '{printable(word)}'; {nearest(word, COMMANDS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands by stage."""
        for stage, commands in STAGES.items():
            with formatter.section(stage):
                formatter.write_dl([(f"{name:12}", sentence) for name, sentence in commands.items()])


app = typer.Typer(
    cls=CommandGroup,
    name="creepkit",
    add_completion=False,
    rich_markup_mode=None,  # plain help and errors: half the start-up time, and an error stays one line
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _print_version(requested: bool) -> None:
    if requested:
        import creepkit
        from creepkit.reports.terminal import tell

        tell(f"creepkit {creepkit.__version__}")
        raise typer.Exit


@app.callback()
def global_options(
    plugin: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", is_eager=True, help="Load this plugin file as well; may be given several times."),
    ] = None,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Creep laws: read tests, identify laws from them, and simulate, forecast and export what was identified.

    'creepkit COMMAND --help' describes a command; 'creepkit demo' shows what comes out.
    """


def _load_plugin_files(files: list[Path] | None) -> None:
    if files:
        from creepkit import registry

        known = registry.default_registry()
        for plugin in [known.load_file(file) for file in files]:
            for sentence in known.replaced(plugin):
                say(sentence)


def _is_of_the_command_line(error: Exception) -> bool:
    """Whether typer ends by this exception, or says in its own words what is wrong with the options."""
    usage_error = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")
    return isinstance(error, typer.Exit | typer.Abort | usage_error)
