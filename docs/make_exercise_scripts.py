"""Write the reference and faulty scripts of the exercises that need eyes: `python docs/make_exercise_scripts.py`.

The driver looks through the eyepieces of the exercise's own instrument and writes its settings into a script.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from a7sim.geometry import GON
from a7sim.link.client.client import Client
from a7sim.link.headers import header, registration_word, short_form
from a7sim.link.inprocess import InProcessSerial
from a7sim.plotters import REQUIRED_FITTINGS
from a7sim.training.attempts import run_opening
from a7sim.training.catalogue import find_exercise
from a7sim.training.environment import open_environment
from a7sim.training.handouts import make_handout

LOOKS = 8


class Driver:
    """Observer without errors that writes its actions into a script."""

    def __init__(self, environment, seed, intro):
        port = InProcessSerial(
            instrument=environment.instrument, clock=environment.clock, client="student", timeout=1.0
        )
        self.client, self.environment = Client(port), environment
        self.model = environment.record().model
        self.lines = [
            f"scenario {environment.exercise_folder.exercise.scenario} seed {seed}",
            "",
            *(f"# {each}" for each in intro),
        ]
        self.readings = 0
        self.skew = 0.0

    def say(self, line, comment=""):
        self.client.send(line)
        self.lines.append(f"{line:<34}# {comment}" if comment else line)

    def wait(self, seconds, comment=""):
        self.environment.clock.advance(seconds)
        self.lines.append(f"{f'wait {seconds}':<34}# {comment}" if comment else f"wait {seconds}")

    def remark(self, *texts):
        self.lines += ["", *(f"# {each}" for each in texts)]

    def expect(self, query, values, within, comment=""):
        line = f"expect {query} = {values} +- {within}"
        self.lines.append(f"{line:<44}  # {comment}" if comment else line)

    def name(self, position):
        return self.model.standard_points[position]

    def seen(self, point):
        return self.client.numbers(f'EYEP1? "{point}";:EYEP2? "{point}"')

    def fuse(self, point, follow="XYZ", tell=True):
        """Move the mark onto a point, with Z onto the ground too, and write the setting."""
        scale = 1e-3 * self.environment.scenario.plan.projection_height / self.environment.scenario.camera.c
        bx = self.client.numbers("BASE:BX?")[0]
        for _ in range(LOOKS):
            lx, ly, rx, ry = self.seen(point)
            assert max(map(abs, (lx, ly, rx, ry))) < 1e9, f"{point} is not in view"
            x, y, z = self.client.numbers("COUN?")
            rise = (lx - rx) * scale * -z / bx if "Z" in follow else 0.0
            ahead = -rise / -z
            x += (lx + rx) / 2 * scale + ahead * (x - bx / 2)
            y += (ly + ry) / 2 * scale + ahead * y
            at = {"X": x, "Y": y, "Z": z + rise}
            line = "DRIV:" + ";".join(f"{axis} {at[axis]:.2f}" for axis in follow)
            self.client.send(line)
        if tell:
            self.lines.append(line)

    def point_with_left_eye(self, point, side):
        """Bring the mark onto a point by the wheels, X approached from one side; return the X reading."""
        scale = 1e-3 * self.environment.scenario.plan.projection_height / self.environment.scenario.camera.c
        for _ in range(LOOKS):
            dx, dy = self.client.numbers(f'EYEP1? "{point}"')
            x, y = dx * scale, dy * scale
            if abs(x) < 0.0051 and abs(y) < 0.0051:
                break
            if x * side < 0:
                self.say(f"WHE:X {-0.50 * side:.2f}", "too far: turn back and approach again")
                continue
            self.say(f"WHE:X {x:.2f};Y {y:.2f}")
        return self.client.numbers("COUN:X?")[0]

    def select_point(self, position, rough):
        self.client.send("DRIV:X {:.2f};Y {:.2f}".format(*rough))
        self.fuse(self.name(position))

    def clear(self, element, by):
        """Turn by until the parallax is cleared to the least count; return the drum reading."""
        point, sense = self.name(by), -1.0 if element == "by1" else 1.0
        scale = 1e-3 * self.environment.scenario.plan.projection_height / self.environment.scenario.camera.c
        at = self.client.numbers(f"{header(element)}?")[0]
        for _ in range(LOOKS):
            self.fuse(point, "XYZ", tell=False)
            _, ly, _, ry = self.seen(point)
            if abs((ly - ry) * scale) < 0.0051:
                break
            at = round(at - (ly - ry) * scale / sense, 2)
            self.client.send(f"{header(element)} {at:.2f}")
        return at

    def turn_to_clear(self, element, position):
        """Turn a drum between its counts until a point is clear; return the turn."""
        point, turned, probe = self.name(position), 0.0, 0.02
        for _ in range(LOOKS):
            before = self._parallax(point)
            self.client.send(f"{header(element)}:TURN {probe:.4f}")
            turned += probe
            after = self._parallax(point)
            if abs(after) < 0.3 or after == before:
                break
            probe = round(max(-1.0, min(1.0, -after * probe / (after - before))), 4)
            if probe == 0.0:
                break
        return turned

    def _parallax(self, point):
        self.fuse(point, tell=False)
        _, left, _, right = self.seen(point)
        return left - right

    def fiducials(self, projector):
        """Read the fiducials, and write the query and the readings into the script."""
        fields = self.client.fields(f"PHOT{projector}:FID?")
        shown = ", ".join(f'"{each}"' if i % 3 == 0 else each for i, each in enumerate(fields))
        self.lines.append(f"expect PHOT{projector}:FID? = {shown} +- 0.001")
        return {fields[i]: (float(fields[i + 1]), float(fields[i + 2])) for i in range(0, len(fields), 3)}

    def record(self, point, element=""):
        self.say(f'REC "{point}"' + (f",{registration_word(element)}" if element else ""))
        self.readings += 1

    def finish(self, path):
        if self.readings:
            self.lines += ["", f"expect REC:COUN? = {self.readings}"]
        path.write_text("\n".join(self.lines) + "\n", encoding="utf-8")


ROUGH = {"1": (0, 0), "2": (195, 0), "3": (0, 182), "4": (195, 182), "5": (0, -182), "6": (195, -182)}
"""Approximate positions of the standard points below the centres, mm."""


def scripts_of(name, seed, play, variants):
    """Write the scripts of an exercise from `variants`: file name, variant and heading of each."""
    exercise_folder = find_exercise(name)
    for file, otherwise, intro in variants:
        with (
            tempfile.TemporaryDirectory() as folder,
            open_environment(exercise_folder, seed, Path(folder), "author", "practice") as environment,
        ):
            run_opening(environment)
            driver = Driver(environment, seed, intro)
            play(driver, otherwise)
            driver.finish(exercise_folder.folder / file)
            print(exercise_folder.folder / file)


def parallax(driver, otherwise):
    signs = {"by1": "by'", "by2": 'by"'}
    for position in "315624":
        driver.remark(f"Point {position}")
        driver.wait(240, "time to look, to turn and to write")
        name = driver.name(position)
        if otherwise == "in the air" and position != "3":
            driver.client.send("DRIV:X {:.2f};Y {:.2f}".format(*ROUGH[position]))
            driver.fuse(name, "XY")
        else:
            driver.select_point(position, ROUGH[position])
        for element in ("by1", "by2"):
            if otherwise == "half" and element == "by2" and position in "456":
                continue
            other = "by2" if element == "by1" else "by1"
            rest = driver.client.numbers(f"{header(element)}?")[0]
            at = driver.clear(element, position)
            if otherwise == "wrong way" and position == "5" and element == "by1":
                at = -at
            for again in range(2):
                if again and otherwise != "no second":
                    driver.say(f"{header(element)} {at - 0.08:.2f}", "turn away before the second reading")
                if not (again and otherwise == "no second"):
                    driver.say(f"{header(element)} {at:.2f}", "" if again else f"cleared with {signs[element]}")
                if not again:
                    driver.fuse(name, "Y" if otherwise == "in the air" else "YZ")
                driver.record(name, element)
            left = otherwise == "left" and position == "3" and element == "by2"
            if not left:
                driver.say(f"{header(element)} {0 if otherwise != 'left' else rest:g}")
            assert other


def counters(driver, otherwise):
    places = {"A": (40.0, 60.0), "B": (150.0, -80.0), "C": (97.5, 12.34)}
    for name, (x, y) in places.items():
        driver.remark(f"Position {name}: X {x:.2f}, Y {y:.2f}, twice, approached from smaller readings")
        driver.wait(120, "time to set the position and to read")
        for again in range(2):
            if again and otherwise == "no second":
                driver.record(name)
                continue
            from_above = otherwise == "from above" and name in "BC"
            step = -0.50 if from_above else 0.50
            driver.say(f"DRIV:X {x - step:.2f};Y {y - step:.2f}", "approach" if not again else "move away and return")
            if otherwise == "by motor" and name == "C":
                driver.say(f"DRIV:X {x:.2f};Y {y:.2f}", "run by motor")
            elif otherwise == "off by a tenth" and name == "B":
                driver.say(f"WHE:X {step - 0.10:.2f};Y {step:.2f}", "the drum is misread")
            else:
                driver.say(f"WHE:X {step:.2f};Y {step:.2f}", "by hand, upwards" if step > 0 else "by hand, downwards")
            driver.record(name)
    driver.remark("Set two drums to the hundredth")
    driver.wait(60)
    driver.say("PROJ1:BZ 1.25")
    driver.say("PROJ2:BY -0.37")
    driver.remark(
        "The play of the X spindle: the mark of the left eye on point 1, approached first from smaller readings, then",
        "from larger ones. The picture is the same both times; the counter readings differ.",
    )
    driver.wait(180)
    point, read = driver.name("1"), {}
    driver.client.send("PROJ1:BZ 1.25;:DRIV:X 0;Y 0;Z -330")
    for side in (1,) if otherwise == "one side" else (1, -1):
        driver.say("DRIV:Y -5.00;Z -330.00")
        driver.say(f"DRIV:X {-3.0 * side:.2f}", "beyond it, on the " + ("left" if side > 0 else "right"))
        read[side] = driver.point_with_left_eye(point, side)
        driver.record(point)
    play = round(read[1] - read[-1], 2) if len(read) > 1 else 0.00
    driver.remark("The difference of the two readings is the play.")
    driver.say(f'NOTE "answer play={play:.2f}"')


CASES = {
    "A": ("negative", "inside", "101n", "102n"),
    "B": ("negative", "outside", "103n", "102n"),
    "C": ("positive", "outside", "103", "102"),
    "D": ("positive", "inside", "101", "102"),
}


def fittings(driver, otherwise):
    nodes = {"dove": "DOVE", "triangulation": "TRI", "diapositive": "DIAP", "xcollar": "XCOL", "ycollar": "YCOL"}
    forgotten = {"y collar": ("A", "ycollar"), "dove": ("B", "dove"), "diapositive": ("C", "diapositive")}
    forgotten["triangulation"] = ("D", "triangulation")
    lying = ["", ""]
    for letter, (polarity, base, left, right) in CASES.items():
        driver.remark(f"{letter}: {polarity}s, base {base[:-4]}, {left} on the left and {right} on the right")
        for projector, name in ((1, left), (2, right)):
            if lying[projector - 1] != name:
                driver.say(f'PHOT{projector}:LOAD "{name}"')
                lying[projector - 1] = name
        driver.wait(200, "time to place the pictures")
        driver.say(f"BASE:MODE {short_form(base)}")
        for fitting, position in REQUIRED_FITTINGS[polarity, base].as_words().items():
            if (letter, fitting) != forgotten.get(otherwise):
                driver.say(f"FITT:{nodes[fitting]} {short_form(position)}")
        if otherwise != "blind" or letter == "A":
            driver.lines += ["# Look, turn a handwheel, and look again.", "expect EYEP1:PICT? 1,1,8 = *"]
            driver.client.block("EYEP1:PICT? 1,1,8")
            driver.say("WHE:X 1;Y 1")
        driver.record(letter)


def interior(driver, otherwise):
    camera = driver.environment.scenario.camera
    places = {each.name: (each.x, each.y) for each in camera.fiducials}
    pictures = {1: "101", 2: "102"} if otherwise != "exchanged" else {1: "102", 2: "101"}
    for projector, picture in pictures.items():
        driver.remark(f"{picture}: place it, read its fiducials, centre it")
        driver.say(f'PHOT{projector}:LOAD "{picture}"')
        driver.wait(300, "time to place the picture, five minutes")
        displaced = driver.fiducials(projector)
        driver.lines.append(
            "# The mean displacement is the shift, the tangential displacement is the rotation; both are corrected."
        )
        xy, d = np.array([places[name] for name in displaced]).T, np.array(list(displaced.values())).T
        turn = float((xy[0] * d[1] - xy[1] * d[0]).sum() / (xy**2).sum()) / GON
        shift = -(d.mean(axis=1) + camera.principal_point)
        if otherwise == "sign" and projector == 1:
            shift = -shift
        driver.say(f"PHOT{projector}:CENT {shift[0]:.3f},{shift[1]:.3f},{-turn:.3f}")
        left = displaced if otherwise == "not checked" else driver.fiducials(projector)
        scale = float((xy * np.array(list(left.values())).T).sum() / (xy**2).sum())
        driver.wait(60, "to compute")
        driver.lines.append(
            f"# The film and the principal distance are smaller by {-1e6 * scale:.0f} parts in a million."
        )
        c = camera.c if otherwise == "certificate" else camera.c * (1.0 + scale)
        driver.say(f"PROJ{projector}:PDIS {c:.2f}")


STEPS = (("2", "by2"), ("1", "kappa2"), ("4", "bz2"), ("3", "phi2"), ("6", "omega2"))


def one_projector(driver, otherwise):
    steps = [STEPS[4], *STEPS[:4]] if otherwise == "omega first" else STEPS
    if otherwise == "left turned":
        steps = [(at, "by1" if element == "by2" else element) for at, element in steps]
    rounds = 1 if otherwise == "one round" else 4
    for number in range(1, rounds + 1):
        driver.remark(f"Round {number}")
        driver.wait(600, "time to look and to turn at five points")
        for position, element in steps:
            driver.select_point(position, ROUGH[position])
            amount = driver.turn_to_clear(element, position)
            if element == "omega2" and otherwise not in ("one round", "omega first"):
                _, y, z = driver.client.numbers("COUN?")
                n = (1.0 + (z / y) ** 2) / 2.0
                driver.client.send(f"{header(element)}:TURN {(n - 1.0) * amount:.4f}")
                explanation = f"point 6 needs {amount:.4f}; multiplied by {n:.2f}"
                amount *= n
            else:
                explanation = f"clears point {position}"
            driver.lines.append(f"{f'{header(element)}:TURN {amount:.4f}':<34}# {explanation}")
    if otherwise == "last point":
        driver.remark("An accidental turn")
        driver.say("PROJ2:PHI:TURN 0.06")
    if otherwise != "not checked":
        driver.remark("All six points once more, without turning an element")
        driver.wait(300)
        for position in "123456":
            driver.select_point(position, ROUGH[position])
            driver.record(driver.name(position))


def slip(driver, otherwise):
    made = make_handout("book with a slip", driver.environment.scenario, driver.environment.seed, {})
    kind, entry, right = made.hidden["kind"], made.hidden["entry"], made.hidden["right"][0]
    wrong = made.papers["book.csv"].splitlines()[entry].split(",")
    driver.lines += ["# The answer for the copy made by the seed above.", ""]
    if otherwise == "entry":
        entry += 1
    if otherwise == "kind":
        kind = "gross" if kind != "gross" else "last digit"
    if otherwise == "right":
        right = wrong[3] if kind == "wrong point" else wrong[5]
    driver.say(f'NOTE "answer kind={kind.replace(" ", "-")} entry={entry} right={right}"')


INTRO = "The y-parallaxes of model 1 at its six standard points, with by' and with by\", twice each."

FITTED = "The four cases of the table of fittings, one after the other."
LAID = "Interior orientation of 101 and 102: fiducials to their marks, principal distances for the shrunken film."
CLEARED = "Relative orientation of model 1 with the right projector alone, point by point."
FOUND = "Answers to: find the slip."
COUNTERS = "Counters, handwheels, drums, and the play of a spindle."

ALL = {
    "counters": (
        "01-counters",
        1,
        counters,
        [
            ("reference.a7s", "", [COUNTERS]),
            (
                "faulty-from-above.a7s",
                "from above",
                [COUNTERS, "Mistake: B and C are approached from larger readings."],
            ),
            (
                "faulty-no-second.a7s",
                "no second",
                [COUNTERS, "Mistake: a position is registered twice without leaving it."],
            ),
            (
                "faulty-misread.a7s",
                "off by a tenth",
                [COUNTERS, "Mistake: the last drum is misread by a tenth at B."],
            ),
            (
                "faulty-by-motor.a7s",
                "by motor",
                [COUNTERS, "Mistake: the carriages are run to C by motor, not by the handwheels."],
            ),
            ("faulty-one-side.a7s", "one side", [COUNTERS, "Mistake: point 1 is approached from one side only."]),
        ],
    ),
    "fittings": (
        "02-fittings",
        2,
        fittings,
        [
            ("reference.a7s", "", [FITTED]),
            ("faulty-y-collar.a7s", "y collar", [FITTED, "Mistake: the Y collar is left out in A."]),
            ("faulty-dove.a7s", "dove", [FITTED, "Mistake: the Dove prisms are not changed in B."]),
            ("faulty-diapositive.a7s", "diapositive", [FITTED, "Mistake: the diapositive lever is not changed in C."]),
            (
                "faulty-triangulation.a7s",
                "triangulation",
                [FITTED, "Mistake: the triangulation lever is not changed in D."],
            ),
            ("faulty-blind.a7s", "blind", [FITTED, "Mistake: the eyepieces are not used from B on."]),
        ],
    ),
    "interior": (
        "03-interior",
        3,
        interior,
        [
            ("reference.a7s", "", [LAID]),
            ("faulty-sign.a7s", "sign", [LAID, "Mistake: the shift of the left picture has the wrong sign."]),
            ("faulty-certificate.a7s", "certificate", [LAID, "Mistake: the shrinkage of the film is ignored."]),
            ("faulty-exchanged.a7s", "exchanged", [LAID, "Mistake: the photographs are exchanged."]),
            (
                "faulty-not-checked.a7s",
                "not checked",
                [LAID, "Mistake: the fiducials are not read again after centring."],
            ),
        ],
    ),
    "one-projector": (
        "05-one-projector",
        5,
        one_projector,
        [
            ("reference.a7s", "", [CLEARED, 'by" at 2, kappa" at 1, bz" at 4, phi" at 3, omega" at 6.']),
            (
                "faulty-one-round.a7s",
                "one round",
                [CLEARED, "Mistake: omega is not over-corrected, and only one round is made."],
            ),
            ("faulty-left-turned.a7s", "left turned", [CLEARED, "Mistake: by' is turned instead of by\"."]),
            ("faulty-omega-first.a7s", "omega first", [CLEARED, 'Mistake: omega" is turned first.']),
            (
                "faulty-not-checked.a7s",
                "not checked",
                [CLEARED, "Mistake: the points are not visited again at the end."],
            ),
            ("faulty-last-point.a7s", "last point", [CLEARED, 'Mistake: phi" is accidentally turned at the end.']),
        ],
    ),
    "slip": (
        "14-slip",
        14,
        slip,
        [
            ("reference.a7s", "", [FOUND]),
            ("faulty-entry.a7s", "entry", [FOUND, "Mistake: the next entry is answered."]),
            ("faulty-kind.a7s", "kind", [FOUND, "Mistake: the slip is answered as another kind."]),
            ("faulty-right.a7s", "right", [FOUND, "Mistake: the wrong value is answered as the correct one."]),
        ],
    ),
    "parallax": (
        "04-parallax",
        4,
        parallax,
        [
            ("reference.a7s", "", [INTRO, "The order of the points is 3, 1, 5, 6, 2, 4."]),
            ("faulty-by2-left.a7s", "left", [INTRO, 'Mistake: by" is left at the setting that cleared point 3.']),
            ("faulty-not-cleared.a7s", "wrong way", [INTRO, "Mistake: by' is turned the wrong way at point 5."]),
            (
                "faulty-no-second-reading.a7s",
                "no second",
                [INTRO, "Mistake: no drum is turned between two readings."],
            ),
            ("faulty-in-the-air.a7s", "in the air", [INTRO, "Mistake: Z is left at the setting for point 3."]),
            ("faulty-half.a7s", "half", [INTRO, 'Mistake: by" is not read at points 4 to 6.']),
        ],
    ),
}

if __name__ == "__main__":
    for chosen in sys.argv[1:] or ALL:
        scripts_of(*ALL[chosen])
