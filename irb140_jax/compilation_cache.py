"""Compiled programs are kept between processes; the one place that says where."""

import os
import pathlib

# Linux lets a process map 65 530 pieces of memory, and every compiled program takes some: past that LLVM crashes.
MOST_MAPS = 20_000


def set_up_compilation_cache() -> pathlib.Path | None:
    """Let JAX keep what it compiles in the user's cache folder, so that the second run of a command starts warm.

    The environment variable IRB140_CACHE names another folder, or is "off".  Where JAX has been given a folder of its
    own (JAX_COMPILATION_CACHE_DIR), that one is used.

    Returns:
        The folder, or None if the cache is off.
    """
    wanted = os.environ.get("IRB140_CACHE", "")
    if wanted.lower() in ("off", "0", "none"):
        return None
    import jax  # here, so that importing this module costs nothing

    home = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache")
    folder = pathlib.Path(wanted or os.environ.get("JAX_COMPILATION_CACHE_DIR") or home / "irb140_jax")
    jax.config.update("jax_compilation_cache_dir", str(folder))
    # Dozens of small programs make up a run; each is quicker read than compiled, so none is too small to keep.
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    return folder


def make_room_for_programs() -> None:
    """Drop compiled programs where they take so much of what a process may map that LLVM would crash some time.

    They are read again from the compilation cache where there is one.
    """
    maps = pathlib.Path("/proc/self/maps")
    if maps.exists() and maps.read_bytes().count(b"\n") > MOST_MAPS:
        import jax

        jax.clear_caches()
