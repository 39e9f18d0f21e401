"""Errors of a plugin's code in words that name the plugin and the signature that was expected of it."""

# pyright: strict

from collections.abc import Generator
from contextlib import contextmanager

from wsph.errors import PluginError, WsphError, is_out_of_memory

RATE_SIGNATURE = "rate(self, space, Params) -> @wp.func (p: Params, stress: space.tensor, L: space.tensor[, q]) -> stress rate[, q rate]"


@contextmanager
def blame(who: str, signature: str = RATE_SIGNATURE) -> Generator[None]:
    """Turn Warp's errors about a plugin's code into one that names the plugin and the signature expected of it."""
    try:
        yield
    except PluginError as error:
        if who in str(error):
            raise
        raise PluginError(f"{who}: {error}") from error
    except WsphError:
        raise
    except OSError as error:
        if is_out_of_memory(error):
            raise
        raise OSError(f"{error} (while {who} was at work)") from error
    except (Exception, SystemExit) as error:  # whatever a third party's code raises
        if is_out_of_memory(error):
            raise
        lines = [line for line in str(error).strip().splitlines() if line.strip()]
        said = f"{type(error).__name__}: {lines[-1]}" if lines else type(error).__name__
        raise PluginError(f"{who}: its code fails ({said}); expected {signature}") from error
