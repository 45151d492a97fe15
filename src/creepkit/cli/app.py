"""The command `creepkit`: its global options, its commands, and how errors end it.

Exit 0 fine, 1 an error that we can explain in one line, 2 wrong usage, 130 interrupted by Ctrl-C.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from creepkit.cli import (
    check,
    confirm,
    data,
    demo,
    design,
    discover,
    export,
    generate,
    identify,
    laws,
    new_law,
    plugins,
    predict,
    reduced_model,
    screen,
    simulate,
    specimens,
    sweep,
    train,
)
from creepkit.cli.described_test import TestCommand
from creepkit.cli.identification_options import CommandWithDefaults
from creepkit.errors import CreepkitError, PluginError


class CommandGroup(TyperGroup):
    """The group of all commands; it asks plugins for theirs when a command is not one of creepkit's own.

    Only then: asking imports every plugin, and `creepkit --help` has no time for that.
    """

    _plugins_loaded = False

    def invoke(self, ctx: Any) -> Any:
        """Run the command; an error of ours becomes one line on stderr and exit code 1."""
        try:
            _load_plugin_files(ctx.params["plugin"])
            return super().invoke(ctx)
        except (CreepkitError, OSError) as error:
            if ctx.params["debug"]:
                raise
            typer.echo(f"creepkit: {' '.join(str(error).split())}", err=True)
            raise typer.Exit(1) from None
        except KeyboardInterrupt:
            typer.echo(f"creepkit: {ctx.invoked_subcommand or ''} interrupted", err=True)
            raise typer.Exit(130) from None

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command of this name, creepkit's own or a plugin's."""
        if cmd_name not in self.commands and not self._plugins_loaded:
            self._plugins_loaded = True
            self.commands.update(_plugin_commands(own_names=set(self.commands)))
        return super().get_command(ctx, cmd_name)


app = typer.Typer(
    cls=CommandGroup,
    name="creepkit",
    add_completion=False,
    rich_markup_mode=None,  # plain help and errors: half the start-up time, and an error stays one line
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


COMMANDS: dict[str, Callable[..., None]] = {
    "laws": laws.command,
    "specimens": specimens.command,
    "plugins": plugins.command,
    "check": check.command,
    "new-law": new_law.command,
    "simulate": simulate.command,
    "reduced-model": reduced_model.command,
    "train": train.command,
    "sweep": sweep.command,
    "generate": generate.command,
    "data": data.command,
    "identify": identify.command,
    "discover": discover.command,
    "screen": screen.command,
    "confirm": confirm.command,
    "predict": predict.command,
    "design": design.command,
    "export": export.command,
    "demo": demo.command,
}


TEST_COMMANDS = ("simulate", "predict")
"""Commands whose options describe a test, of any specimen."""


for name, command in COMMANDS.items():
    app.command(name, cls=TestCommand if name in TEST_COMMANDS else CommandWithDefaults)(command)


def _print_version(requested: bool) -> None:
    if requested:
        import creepkit

        typer.echo(f"creepkit {creepkit.__version__}")
        raise typer.Exit


@app.callback()
def global_options(
    plugin: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Load this plugin file as well; may be given several times."),
    ] = None,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Creep laws: list them, simulate them, and identify them from creep curves.

    Plugins may add laws and commands: 'creepkit plugins' lists what they bring.
    """


def _load_plugin_files(files: list[Path] | None) -> None:
    if files:
        from creepkit import registry

        for file in files:
            registry.default_registry().load_file(file)


def _plugin_commands(own_names: set[str]) -> dict[str, Any]:
    """Return {name: command} of what plugins add; PluginError when a name is one of creepkit's own."""
    from creepkit import registry

    extra = typer.Typer()
    registry.default_registry().add_commands(extra)
    added = typer.main.get_group(extra).commands
    for name in sorted(own_names & set(added)):
        raise PluginError(f"a plugin adds the command '{name}', which creepkit has already; see 'creepkit plugins'")
    return dict(added)
