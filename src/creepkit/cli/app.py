"""The command `creepkit`: its global options, its commands, and how errors end it.

Exit 0 fine, 1 an error that we can explain in one line, 2 wrong usage, 70 a fault of creepkit, 130 interrupted by
Ctrl-C, 143 by SIGTERM, 129 by SIGHUP, 141 nobody reads the output any more.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from creepkit.cli import (
    app_page,
    check,
    confirm,
    data,
    demo,
    design,
    discover,
    export,
    extract,
    generate,
    identify,
    init,
    laws,
    new_exporter,
    new_law,
    new_reader,
    new_specimen,
    plugins,
    predict,
    read,
    reduced_model,
    report,
    run,
    rupture,
    screen,
    simulate,
    specimens,
    sweep,
    train,
)
from creepkit.cli.declared_options import checked
from creepkit.cli.described_test import TestCommand
from creepkit.cli.failures import NO_READER, failure_sentence, output_sentence, say
from creepkit.cli.given_options import CheckedCommand
from creepkit.cli.interrupts import exit_code, interrupted_sentence, was_interrupted
from creepkit.errors import CreepkitError, PluginError
from creepkit.files.writing import FULL
from creepkit.reports.terminal import printable, tell


class CommandGroup(TyperGroup):
    """The group of all commands; it asks plugins for theirs when a command is not one of creepkit's own.

    Only then all plugins are imported; `creepkit --help` imports those alone whose text names the hook for commands.
    """

    _plugins_asked = False

    def make_context(self, *names: Any, **options: Any) -> Any:
        """Read the command line; `--help` and `--version` print what they are asked for already here."""
        with self._errors_in_one_line("--debug" in sys.argv):
            return super().make_context(*names, **options)

    def invoke(self, ctx: Any) -> Any:
        """Run the command; an error of ours becomes one line on stderr and exit code 1."""
        with self._errors_in_one_line(ctx.params["debug"], ctx):
            _check_files_in_environment()
            _load_plugin_files(ctx.params["plugin"])
            return super().invoke(ctx)

    @contextmanager
    def _errors_in_one_line(self, debug: bool, ctx: Any = None) -> Iterator[None]:
        try:
            yield
        except KeyboardInterrupt as error:
            raise self._interrupted(ctx, error) from None
        except Exception as error:
            if debug or _is_of_the_command_line(error):
                if isinstance(getattr(error, "message", None), str):  # it names options and arguments as they came
                    error.message = printable(error.message)  # type: ignore[attr-defined]
                raise
            if was_interrupted():
                raise self._interrupted(ctx, error) from None
            if isinstance(error, BrokenPipeError):
                raise typer.Exit(NO_READER) from None
            if isinstance(error, CreepkitError | OSError):
                raise _ended(_sentence(error), 1) from None
            raise _ended(*failure_sentence(error)) from None

    def _interrupted(self, ctx: Any, error: BaseException) -> typer.Exit:
        if ctx is None:
            return _ended(interrupted_sentence(None), exit_code())
        name = ctx.invoked_subcommand or ""
        kept = str(error) if isinstance(error, KeyboardInterrupt) else ""
        return _ended(interrupted_sentence(name, self.commands.get(name), kept), exit_code())

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command of this name, creepkit's own or a plugin's; say which plugins failed where none has it."""
        if cmd_name not in self.commands and not self._plugins_asked:
            self._plugins_asked = True
            added, problems = _plugin_commands(set(self.commands))
            self.commands.update(added)
            for problem in problems if cmd_name not in added else ():
                tell(f"creepkit: {problem}", err=True)
        return super().get_command(ctx, cmd_name)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write creepkit's own commands, those of plugins, and what is wrong with plugins that add commands."""
        super().format_commands(ctx, formatter)
        try:
            _load_plugin_files(ctx.params.get("plugin"))
            failed: tuple[str, ...] = ()
        except PluginError as error:
            failed = (str(error),)
        added, problems = _plugin_commands(set(self.commands))
        shown = {name: command for name, command in sorted(added.items()) if not command.hidden}
        if shown:
            limit = formatter.width - 6 - max(map(len, shown))
            with formatter.section("Commands of plugins"):
                formatter.write_dl([(name, command.get_short_help_str(limit)) for name, command in shown.items()])
        if failed or problems:
            with formatter.section("Plugins that failed"):
                for problem in (*failed, *problems):
                    formatter.write(f"  {problem}\n")


app = typer.Typer(
    cls=CommandGroup,
    name="creepkit",
    add_completion=False,
    rich_markup_mode=None,  # plain help and errors: half the start-up time, and an error stays one line
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


COMMANDS: dict[str, Callable[..., None]] = {
    "init": init.command,
    "run": run.command,
    "laws": laws.command,
    "specimens": specimens.command,
    "plugins": plugins.command,
    "check": check.command,
    "new-law": new_law.command,
    "new-specimen": new_specimen.command,
    "new-reader": new_reader.command,
    "new-exporter": new_exporter.command,
    "simulate": simulate.command,
    "reduced-model": reduced_model.command,
    "train": train.command,
    "sweep": sweep.command,
    "generate": generate.command,
    "read": read.command,
    "data": data.command,
    "extract": extract.command,
    "identify": identify.command,
    "discover": discover.command,
    "screen": screen.command,
    "confirm": confirm.command,
    "predict": predict.command,
    "design": design.command,
    "rupture": rupture.command,
    "export": export.command,
    "report": report.command,
    "app": app_page.command,
    "demo": demo.command,
}


TEST_COMMANDS = ("simulate", "predict")
"""Commands whose options describe a test, of any specimen."""


for name, command in COMMANDS.items():
    app.command(name, cls=TestCommand if name in TEST_COMMANDS else CheckedCommand)(checked(command))


def _print_version(requested: bool) -> None:
    if requested:
        import creepkit

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
    """Creep laws: list them, simulate them, and identify them from creep curves.

    Plugins may add laws and commands: 'creepkit plugins' lists what they bring.
    """


def _check_files_in_environment() -> None:
    if os.environ.get("CREEPKIT_PLUGINS"):
        from creepkit.registry.plugin_sources import check_files_in_environment

        check_files_in_environment()


def _load_plugin_files(files: list[Path] | None) -> None:
    if files:
        from creepkit import registry

        known = registry.default_registry()
        for plugin in [known.load_file(file) for file in files]:
            for sentence in known.replaced(plugin):
                tell(f"creepkit: {sentence}", err=True)


def _plugin_commands(own_names: set[str]) -> tuple[dict[str, Any], list[str]]:
    """Return {name: command} of what plugins add, and a sentence for each plugin or command that cannot be used."""
    from creepkit import registry

    added: dict[str, Any] = {}
    problems: list[str] = []
    for plugin, app in registry.default_registry().command_lines():
        try:
            commands = typer.main.get_group(app).commands
        except Exception as error:  # of the signature of somebody else's command
            problems.append(f"{plugin.provenance}: its commands cannot be used: {' '.join(str(error).split())}")
            continue
        problems += [plugin.problem] if plugin.problem else []
        for name, command in commands.items():
            if name in own_names or name in added:
                other = "creepkit" if name in own_names else "another plugin"
                problems.append(f"{plugin.provenance} adds the command '{name}', which {other} has already; rename it")
            else:
                added[name] = command
    return added, problems


def _ended(sentence: str, code: int) -> typer.Exit:
    """The end of the command, after one line on stderr."""
    say(" ".join(sentence.split()))
    return typer.Exit(code)


def _is_of_the_command_line(error: Exception) -> bool:
    """Whether typer ends by this exception, or says in its own words what is wrong with the options."""
    usage_error = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")
    return isinstance(error, typer.Exit | typer.Abort | usage_error)


def _sentence(error: Exception) -> str:
    """What an error says; with advice where it is the system's."""
    if not isinstance(error, OSError) or isinstance(error, CreepkitError) or not error.strerror:
        return str(error)
    if error.filename is None and error.errno in FULL:  # errors of files that we write have their names
        return output_sentence(error)
    place = f"{error.filename}: " if error.filename is not None else ""
    if error.strerror.startswith("No usable temporary directory"):  # PyTorch wants one to train networks
        return f"{error.strerror}; set the environment variable TMPDIR to a folder that you can write to"
    return f"{place}{error.strerror}; check the name, who may read and write there, and the space of the disk"
