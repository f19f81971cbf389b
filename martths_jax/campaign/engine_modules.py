"""Which modules of this package decide a number; a test compares the list with the imports."""

#: Patterns below the package's folder.  Whatever is not here shows results, stores them, or makes
#: inputs that are identified by themselves (the samples of a motion, the settings of a run).
ENGINE_MODULES = (
    "algebra/*.py",
    "benchmark.py",
    "blocks.py",
    "campaign/draws.py",
    "campaign/engine.py",
    "campaign/lanes.py",
    "control/*.py",
    "control/*/*.py",
    "control/*/*/*.py",
    "coupler.py",
    "indices/*.py",
    "loop.py",
    "observers.py",
    "once.py",
    "plant.py",
    "result.py",
    "runtime.py",
    "sensitivity/design.py",
    "sensors.py",
    "signals.py",
    "simulation.py",
    "structure/*.py",
    "structure/*/*.py",
    "transfer.py",
    "watch.py",
    "xla_flags.py",
)
