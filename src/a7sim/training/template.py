"""Template of a new exercise; `check-exercise` lists what is missing."""

from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.training.catalogue import FILE

_EXERCISE = """\
schema_version = 1
number = {number}
title = "{title}"
goal = "Say in a sentence or two what is to be done."
scenario = "akwanga"
minutes = 30
reference = {{ script = "reference.a7s" }}

# What is done at the instrument before the student sits down; leave it out where they begin at nothing.
[opening]
script = "opening.a7s"

# Values of the scenario by path, instead of its own, and what of it every seed draws anew within so much.
[settings]
"instrument.laying_sigma_mm" = 0.0
"instrument.laying_sigma_gon" = 0.0

[vary]
"photos.0.omega" = 0.05

[[step]]
text = "Register point 1 twice"
measure = "missing-readings"
options = {{ points = ["1"], each = 2 }}
done = 0

[[criterion]]
id = "complete"
title = "all readings are there"
measure = "missing-readings"
options = {{ points = ["1"], each = 2 }}
excellent = 0
pass = 0
weight = 50
feedback = "Say what to do better."

[[criterion]]
id = "pointed"
title = "the mark stands on the point"
measure = "beside-the-point"
options = {{ points = ["1"], eye = 1 }}
excellent = 12
pass = 30
weight = 50
feedback = "Say what to do better."

# Two hints or more.
[[hint]]
text = "A small hint."
cost = 2

# Two faulty scripts or more, each with the criterion that must fail and why.
[[faulty]]
script = "faulty-once.a7s"
fails = "complete"
why = "Point 1 is registered once only."
"""

_OPENING = """\
scenario akwanga seed 1

*RST
BASE:BX 194.99
PHOT1:LOAD "101"
PROJ1:PDIS 152.66
PROJ1:KAPP 399.50;PHI 100.27;OMEG 99.03
DRIV:X 1.00;Y -2.00;Z -330.00
"""

_REFERENCE = """\
scenario akwanga seed 1

# Say what is done and why. `a7sim train start FOLDER --script reference.a7s` plays it.
REC "1011"
WHE:X -0.50
WHE:X 0.50
REC "1011"
"""

_FAULTY = """\
scenario akwanga seed 1

# By mistake point 1 is registered once only.
REC "1011"
"""


def write_template(folder: Path, number: int) -> Path:
    """Write the template of an exercise into a new folder and return it. Raises A7SimError if that fails."""
    title = folder.name.lstrip("0123456789-_").replace("-", " ").strip().capitalize() or "A new exercise"
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise A7SimError(f"{folder}: expected a folder that does not exist yet: {error.strerror}") from error
    escaped = title.replace("\\", "\\\\").replace('"', '\\"')
    texts = {
        FILE: _EXERCISE.format(number=number, title=escaped),
        "text.md": f"# {title}\n\nSay in plain words what there is to learn, and what to do.\n",
        "opening.a7s": _OPENING,
        "reference.a7s": _REFERENCE,
        "faulty-once.a7s": _FAULTY,
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder
