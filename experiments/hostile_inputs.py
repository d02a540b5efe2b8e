"""Hostile inputs through the real command line, counted in docs/hostile-inputs.md: python experiments/hostile_inputs.py

Every case runs in a folder of its own, in one process, with a time limit.  The search is stopped before it begins where
only reading and checks are judged; whatever comes before it is the real thing.
"""

import argparse
import collections
import contextlib
import hashlib
import io
import json
import os
import pathlib
import shutil
import signal
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pandas as pd

from irb140_jax import cli
from irb140_jax.errors import InputError
from irb140_jax.robot import irb140_path

ROOT = pathlib.Path(__file__).resolve().parents[1]
LIMIT = 60  # [s] a case may take
TWO = """<mujoco model="two"><compiler angle="radian"/><worldbody><body>
<joint name="a" axis="0 1 0" range="-3 3"/><inertial pos="0.2 0 0.02" mass="4" diaginertia="0.02 0.06 0.06"/>
<body pos="0.5 0 0"><joint name="b" axis="0 1 0" range="-3 3"/>
<inertial pos="0.2 0.02 0" mass="2" diaginertia="0.01 0.03 0.03"/></body></body></worldbody></mujoco>"""


class Case(NamedTuple):
    """One run.

    Attributes:
        group, name: What is hostile about it.
        prepare: Makes its files in a folder and gives the words of the command line.
        refuse: Whether its input can't be used; then it has to be refused, or at least noted.
    """

    group: str
    name: str
    prepare: Callable[[pathlib.Path], list]
    refuse: bool


class Outcome(NamedTuple):
    """What a run came to: exit code (None: it hung), whether the search was reached, notes made by then."""

    code: int | None
    reached: bool
    notes: set[str]
    said: str
    traceback: bool
    lost: list[str]


def recording_of(model: mujoco.MjModel, seed: int = 0) -> pd.DataFrame:
    """Twelve seconds at 100 Hz along sums of sines, torque by MuJoCo with friction and noise."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 12.0, 0.01)
    w = 2 * np.pi * np.array([0.2, 0.35, 0.55])[:, None, None]
    a, phase = (rng.uniform(*r, (3, 1, model.nv)) for r in ((0.1, 0.3), (0.0, 6.0)))
    angle = w * t[:, None] + phase
    q, qd, qdd = (a * np.sin(angle)).sum(0), (a * w * np.cos(angle)).sum(0), -(a * w**2 * np.sin(angle)).sum(0)
    data, tau = mujoco.MjData(model), np.empty_like(q)
    for i in range(len(t)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[i], qd[i], qdd[i]
        mujoco.mj_inverse(model, data)
        tau[i] = data.qfrc_inverse
    tau = tau + 0.03 * tau.std(0) * np.sign(qd) + 0.01 * tau.std(0) * rng.normal(size=tau.shape)
    names = [model.joint(i).name for i in range(model.njnt)]
    columns = {"t": t} | {f"q.{j}": q[:, i] for i, j in enumerate(names)}
    return pd.DataFrame(columns | {f"tau.{j}": tau[:, i] for i, j in enumerate(names)})


class Arm:
    """A model, a sound recording of it, and ways to spoil either."""

    def __init__(self, xml: str):
        self.xml, model = xml, mujoco.MjModel.from_xml_string(xml)
        self.table = recording_of(model)
        self.joints = [model.joint(i).name for i in range(model.njnt)]

    def words(self, folder: pathlib.Path, name: str, *more: object) -> list:
        """A diagnosis of a file."""
        (folder / "arm.xml").write_text(self.xml)
        return ["diagnose", folder / name, "--robot", folder / "arm.xml", "--out", folder / "out", *more]

    def written(self, table: Any, path: pathlib.Path) -> bytes:
        """A recording on disk, by its suffix."""
        if path.suffix == ".npz":
            np.savez(path, **{name: table[name].to_numpy() for name in table})
        elif path.suffix == ".parquet":
            table.to_parquet(path)
        else:
            table.to_csv(path, index=False)
        return path.read_bytes()

    def spoilt_bytes(self) -> Iterator[Case]:
        """Files cut off, with flipped bits, of other kinds than their suffix says."""
        rng = np.random.default_rng(5)
        kinds = (".csv", ".parquet", ".npz")

        def case(name: str, suffix: str, spoil: Callable[[bytes], bytes], refuse: bool) -> Case:
            def prepare(folder: pathlib.Path) -> list:
                path = folder / f"r{suffix}"
                path.write_bytes(spoil(self.written(self.table, path)))
                return self.words(folder, path.name)

            return Case("broken files", f"{suffix[1:]} {name}", prepare, refuse)

        def flipped(content: bytes, seed: int, count: int) -> bytes:
            draw, out = np.random.default_rng(seed), bytearray(content)
            for place in draw.integers(len(out), size=count):
                out[place] ^= 1 << int(draw.integers(8))
            return bytes(out)

        for suffix in kinds:
            for share in (0.02, 0.5, 0.97):
                cut = lambda c, share=share: c[: int(share * len(c))]  # noqa: E731
                yield case(f"cut at {share:.0%}", suffix, cut, suffix != ".csv")
            for seed in range(12):
                yield case(f"{3 + 8 * seed} bits flipped", suffix,
                           lambda c, s=seed: flipped(c, s, 3 + 8 * s), False)  # fmt: skip
            noise = rng.bytes(4000)
            plain = {"nothing": b"", "noise": noise, "zeros": bytes(4000), "deep JSON": b"[" * 10**5,
                     "HTML": b"<html><body>404</body></html>\n" * 9, "line feeds": b"\n" * 999}  # fmt: skip
            for name, content in plain.items():
                yield case(f"of {name}", suffix, lambda _, c=content: c, True)
            for other in kinds:
                if other != suffix:
                    yield self._under_another_suffix(other, suffix)

    def _under_another_suffix(self, kind: str, suffix: str) -> Case:
        def prepare(folder: pathlib.Path) -> list:
            content = self.written(self.table, folder / f"x{kind}")
            (folder / f"x{kind}").unlink()
            (folder / f"r{suffix}").write_bytes(content)
            return self.words(folder, f"r{suffix}")

        return Case("broken files", f"{kind[1:]} under {suffix}", prepare, True)

    def odd_archives(self) -> Iterator[Case]:
        """NPZ and Parquet files that are whole and hold something else."""

        def case(name: str, make: Callable[[pathlib.Path], object], file: str = "r.npz") -> Case:
            def prepare(folder: pathlib.Path) -> list:
                make(folder / file)
                return self.words(folder, file)

            return Case("odd archives", name, prepare, True)

        def npy(path: pathlib.Path) -> None:
            with path.open("wb") as file:
                np.save(file, np.eye(3))

        def declared(path: pathlib.Path) -> None:
            head = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000000,), }".ljust(117) + "\n"
            with zipfile.ZipFile(path, "w") as file:
                file.writestr("t.npy", b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode())

        def members(content: bytes) -> Callable[[pathlib.Path], None]:
            def make(path: pathlib.Path) -> None:
                with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
                    file.writestr("t.npy", content)

            return make

        columns: dict[str, Any] = {name: self.table[name].to_numpy() for name in self.table}

        def with_t(t: Any) -> Callable[[pathlib.Path], None]:
            changed: dict[str, Any] = {**columns, "t": t}
            return lambda path: np.savez(path, **changed)

        yield case("an .npy under .npz", npy)
        yield case("1e15 declared values", declared)
        yield case("text members", members(b"hello"))
        yield case("a member of 200 MB of zeros", members(bytes(200 * 2**20)))
        yield case("objects", with_t(np.array([{}] * 1200)))
        yield case("complex numbers", with_t(1j * columns["t"]))
        yield case("three dimensions", with_t(np.zeros((3, 3, 3))))
        yield case("columns of two lengths", with_t(columns["t"][:-5]))
        yield case("words", with_t(np.array(["x"] * 1200)))
        lists = self.table.assign(t=[[float(t)] for t in self.table["t"]])
        yield case("lists in a column", lambda p: lists.to_parquet(p), "r.parquet")
        yield case("no rows", lambda p: self.table[:0].to_parquet(p), "r.parquet")
        yield case("a folder as a file", lambda p: p.mkdir(), "r.parquet")
        yield case("a pipe that nobody writes to", lambda p: os.mkfifo(p), "r.csv")

    def odd_values(self) -> Iterator[Case]:
        """Tables that can be read and hold what no robot did."""
        q, tau, n = f"q.{self.joints[0]}", f"tau.{self.joints[0]}", len(self.table)

        def case(name: str, spoil: Callable[[pd.DataFrame], Any], refuse: bool = True) -> Case:
            def prepare(folder: pathlib.Path) -> list:
                table = self.table.copy()
                changed = spoil(table)
                self.written(table if changed is None else changed, folder / "r.csv")
                return self.words(folder, "r.csv")

            return Case("odd values", name, prepare, refuse)

        def put(column: str, rows: slice, value: object) -> Callable[[pd.DataFrame], Any]:
            def spoil(table: pd.DataFrame) -> None:
                table[column] = table[column].astype(object)
                table.loc[table.index[rows], column] = value  # pyright: ignore[reportArgumentType]

            return spoil

        every, one = slice(None), slice(n // 2, n // 2 + 1)
        for column in ("t", q, tau):
            yield case(f"{column[:3]} missing", lambda d, c=column: d.drop(columns=c))
            yield case(f"{column[:3]} empty", put(column, every, None))
            for value in ("abc", "inf", "1e308", "-1e308", "1e400", "0x1F", "1,5", "nan", "NULL", "=1+1", "１２"):
                yield case(f"{column[:3]} all {value}", put(column, every, value))
            yield case(f"{column[:3]} once a word", put(column, one, "oops"))
            yield case(f"{column[:3]} once infinite", put(column, one, "inf"))
            yield case(f"{column[:3]} once missing", put(column, one, None), False)
            yield case(f"{column[:3]} half missing", put(column, slice(0, n // 2), None), False)
            yield case(f"{column[:3]} constant", put(column, every, 0.5))
            yield case(f"{column[:3]} all zero", put(column, every, 0.0))
        yield case("time backwards", lambda d: d[::-1])
        yield case("time shuffled", lambda d: d.sample(frac=1.0, random_state=1))
        yield case("time in milliseconds", lambda d: d.assign(t=1e3 * d["t"]))
        yield case("time in nanoseconds", lambda d: d.assign(t=1e9 * d["t"]))
        yield case("time since 1970", lambda d: d.assign(t=1.7e9 + d["t"]), False)
        yield case("one row", lambda d: d[:1])
        yield case("three rows", lambda d: d[:3])
        yield case("no rows", lambda d: d[:0])
        yield case("every row twice", lambda d: d.loc[d.index.repeat(2)], False)
        yield case("positions in degrees", lambda d: d.assign(**{c: np.degrees(d[c]) for c in d if c[:2] == "q."}))
        yield case("torque a thousand times", lambda d: d.assign(**{c: 1e3 * d[c] for c in d if c[:3] == "tau"}))
        yield case("torque all zero", lambda d: d.assign(**{c: 0.0 for c in d if c[:3] == "tau"}))
        yield case("torque turned round", lambda d: d.assign(**{c: -d[c] for c in d if c[:3] == "tau"}))
        yield case("header of another robot", lambda d: d.rename(columns=lambda c: c.replace(".", ".other_")))
        yield case("a column more of words", lambda d: d.assign(remark="fine"), False)

    def odd_options(self) -> Iterator[Case]:
        """Words that can't be meant."""

        def case(name: str, *more: object) -> Case:
            def prepare(folder: pathlib.Path) -> list:
                self.written(self.table, folder / "r.csv")
                return self.words(folder, "r.csv", *more)

            return Case("odd options", name, prepare, True)

        for value in ("nan", "inf", "-inf", "-0.1", "0", "5", "1e300", "much", "", "0x5", "9" * 400):
            yield case(f"--inertial-uncertainty {value[:9]}", "--inertial-uncertainty", value)
        for option in ("--frobnicate", "--out", "--robot", "--columns", "-x", "---"):
            yield case(f"{option} at the end", option)
        for name, text in {
            "no TOML": "[[[", "empty quantity": '[columns]\n"" = ""\n', "a list": "columns = [1]\n",
            "an unknown joint": '[columns]\n"q.gremlin" = "x"\n', "an unknown unit": '[scale]\n"q.*" = "furlong"\n',
            "infinite scale": '[scale]\n"q.*" = inf\n', "nan rate": "rate = nan\n", "zero rate": "rate = 0\n",
            "a date": "rate = 2020-01-01\n", "scale zero": '[scale]\n"tau.*" = 0.0\n', "an unknown section": "[what]\n",
            "one column for all": '[columns]\n"q.*" = "t"\n',
        }.items():  # fmt: skip
            yield self._with_map(name, text)
        for name, text in {
            "empty": "", "no XML": "hello", "cut off": self.xml[: len(self.xml) // 2], "another root": "<html/>",
            "no joint": "<mujoco><worldbody/></mujoco>", "nan mass": self.xml.replace('mass="', 'mass="nan'),
            "a billion laughs": '<!DOCTYPE l [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><mujoco>&b;</mujoco>',
            "a mesh that is away": "<robot name='r'><link name='l'><visual><geometry><mesh filename='x.stl'/>"
            "</geometry></visual></link></robot>",
        }.items():  # fmt: skip
            yield self._with_model(name, text)

    def _with_map(self, name: str, text: str) -> Case:
        def prepare(folder: pathlib.Path) -> list:
            self.written(self.table, folder / "r.csv")
            (folder / "map.toml").write_text(text)
            return self.words(folder, "r.csv", "--columns", folder / "map.toml")

        return Case("column maps", name, prepare, True)

    def _with_model(self, name: str, text: str) -> Case:
        def prepare(folder: pathlib.Path) -> list:
            self.written(self.table, folder / "r.csv")
            words = self.words(folder, "r.csv")
            (folder / "arm.xml").write_text(text)
            return words

        return Case("robot models", name, prepare, True)

    def outputs(self) -> Iterator[Case]:
        """Outputs that are inputs, can't be written, or hold something of the user's."""

        def case(name: str, out: Callable[[pathlib.Path], object], refuse: bool = True) -> Case:
            def prepare(folder: pathlib.Path) -> list:
                (folder / "in").mkdir()
                self.written(self.table, folder / "in" / "r.csv")
                (folder / "own").mkdir()
                (folder / "own" / "thesis.tex").write_text("mine")
                (folder / "file").write_text("mine")
                (folder / "dangling").symlink_to(folder / "gone")
                (folder / "link").symlink_to(folder / "in")
                (folder / "loop").symlink_to(folder / "loop")
                (folder / "empty").mkdir()
                return [*self.words(folder, "in/r.csv")[:-1], out(folder)]

            return Case("outputs", name, prepare, refuse)

        for name in ("in", "in/r.csv", "in/r.csv/below", "own", "file", "file/below", "dangling", "link", "loop", "."):
            yield case(f"--out {name}", lambda folder, name=name: folder / name)
        yield case("--out of a null character", lambda folder: f"{folder}/a\0b")
        yield case("--out of 300 letters", lambda folder: folder / ("x" * 300))
        yield case("--out of 5000 letters", lambda folder: folder / "/".join(["x" * 100] * 50))
        yield case("--out in /proc", lambda folder: "/proc/irb140")
        yield case("--out in /sys", lambda folder: "/sys/irb140")
        yield case("--out /dev/null", lambda folder: "/dev/null")
        yield case("--out empty folder", lambda folder: folder / "empty", False)

    def names(self) -> Iterator[Case]:
        """Files whose names are no usual ones."""
        for name in ("a b.csv", "ä ö.csv", "x\ny.csv", "[red]x.csv", "%s%n.csv", "{0}.csv", "$HOME.csv", "🤖.csv",
                     "'quoted'.csv", "UPPER.CSV", "a.b.c.csv", "no_suffix", "x.xlsx", "y" * 240 + ".csv"):  # fmt: skip

            def prepare(folder: pathlib.Path, name: str = name) -> list:
                self.written(self.table, folder / "r.csv")
                (folder / "r.csv").rename(folder / name)
                return self.words(folder, name)

            yield Case("names", ascii(name)[:24], prepare, name in ("no_suffix", "x.xlsx"))

    def sound(self) -> Case:
        """Nothing hostile about it."""

        def prepare(folder: pathlib.Path) -> list:
            self.written(self.table, folder / "r.csv")
            return self.words(folder, "r.csv")

        return Case("sound", "sound", prepare, False)

    def cases(self) -> Iterator[Case]:
        """All of them."""
        for part in (self.spoilt_bytes, self.odd_archives, self.odd_values, self.odd_options, self.outputs, self.names):
            yield from part()


def sums(folder: pathlib.Path) -> dict[str, str]:
    """Checksum of every file."""
    files = [p for p in folder.rglob("*") if p.is_file() and not p.is_symlink()]
    return {p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


class Hung(BaseException):
    """The time limit."""


class Harness:
    """Runs cases; the search is replaced by a stop that notes what was known by then."""

    def __init__(self) -> None:
        self.reached, self.notes = False, set[str]()
        import irb140_jax.mismatch  # noqa: F401

        module = sys.modules["irb140_jax.mismatch.diagnose"]
        too_little = getattr(module, "too_little")  # noqa: B009

        def explain(robot, recordings, *_, **__):
            self.reached = True
            self.notes = {note for r in recordings for note in r.notes}
            raise InputError("stopped before the search")

        def nothing_to_search(smooth, band):
            return explain(None, smooth) if too_little(smooth, band) else ""

        setattr(module, "explain", explain)  # noqa: B010
        setattr(module, "too_little", nothing_to_search)  # noqa: B010

    def run(self, case: Case) -> Outcome:
        """One case, in a folder that is made for it and removed afterwards."""
        folder = pathlib.Path(tempfile.mkdtemp(prefix="hostile-"))
        before_here = os.getcwd()
        words = [str(word) for word in case.prepare(folder)]
        before, said = sums(folder), io.StringIO()
        self.reached, self.notes, code = False, set(), None
        (folder / "here").mkdir()
        os.chdir(folder / "here")
        signal.alarm(LIMIT)
        try:
            with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
                code = cli.main(words)
        except Hung:
            pass
        except SystemExit as stop:
            code = int(stop.code or 0)
        except BaseException as error:
            said.write(f"Traceback {error!r}")
            code = 1
        finally:
            signal.alarm(0)
            os.chdir(before_here)
        after = sums(folder)
        lost = [name for name, checksum in before.items() if after.get(name) != checksum]
        left = [name for name in after if name not in before and not name.startswith("here/irb140-error")]
        said_all = said.getvalue() + "".join(p.read_text() for p in (folder / "here").glob("irb140-error-*"))
        shutil.rmtree(folder, ignore_errors=True)
        traceback = "Traceback" in said_all or code not in (0, 2, None)
        return Outcome(code, self.reached, self.notes, said_all, traceback, [*lost, *(f"left: {x}" for x in left)])


def judged(case: Case, outcome: Outcome, usual: set[str]) -> str:
    """What a run counts as; `usual` are the notes that a sound recording has, too."""
    if outcome.code is None:
        return "hung"
    if outcome.traceback:
        return "traceback"
    if outcome.lost:
        return "files lost or left"
    if outcome.reached:
        return "silently wrong" if case.refuse and outcome.notes <= usual else "used"
    return "refused" if outcome.code == 2 and outcome.said.count("\n") == 1 else "more than one line"


def page(rows: list[tuple[str, Case, Outcome, str]]) -> str:
    """The table."""
    kinds = ("refused", "used", "silently wrong", "traceback", "hung", "files lost or left", "more than one line")
    groups = dict.fromkeys((arm, case.group) for arm, case, _, _ in rows)
    counts = collections.Counter((arm, case.group, verdict) for arm, case, _, verdict in rows)
    lines = [
        "# Hostile inputs", "",
        "Written by `python experiments/hostile_inputs.py`: what a stranger may give to `irb140 diagnose`, on an arm",
        "of two joints and on the IRB 140, through the real command line. *Refused*: exit 2, one line, none written.",
        "*Used*: the input passed every check, with a note where it is odd; here the run is stopped before the search.",
        "*Silently wrong*: it should have been refused or noted, and was not. Of files with flipped bits a few pass",
        "whole; what a bit in a digit changes nobody can tell from a measurement.", "",
        f"| arm | group | inputs | {' | '.join(kinds)} |", f"|---|---|{'---:|' * (1 + len(kinds))}",
    ]  # fmt: skip
    for arm, group in groups:
        numbers = [counts[arm, group, kind] for kind in kinds]
        lines.append(f"| {arm} | {group} | {sum(numbers)} | {' | '.join(map(str, numbers))} |")
    total = [sum(verdict == kind for *_, verdict in rows) for kind in kinds]
    lines.append(f"| both | all | **{len(rows)}** | {' | '.join(f'**{x}**' for x in total)} |")
    wrong = [(arm, case, verdict) for arm, case, _, verdict in rows if verdict not in ("refused", "used")]
    if wrong:
        lines += ["", "What went wrong:", "", *(f"- {arm}, {c.group}: {c.name}: {v}" for arm, c, v in wrong)]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=1, help="run only every so many cases, to try it out")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs" / "hostile-inputs.md")
    options = parser.parse_args()

    def hung(*_: object) -> None:
        raise Hung

    signal.signal(signal.SIGALRM, hung)
    harness, rows = Harness(), []
    arms = {"two joints": Arm(TWO), "IRB 140": Arm(pathlib.Path(irb140_path()).read_text(encoding="utf-8"))}
    for arm, made in arms.items():
        usual = harness.run(made.sound()).notes
        for case in list(made.cases())[:: options.every]:
            outcome = harness.run(case)
            verdict = judged(case, outcome, usual)
            rows.append((arm, case, outcome, verdict))
            if verdict not in ("refused", "used"):
                details = {"arm": arm, "case": f"{case.group}: {case.name}", "verdict": verdict, "lost": outcome.lost}
                print(json.dumps(details | {"said": outcome.said[-600:]}), flush=True)
    options.out.write_text(page(rows), encoding="utf-8")
    print(collections.Counter(verdict for *_, verdict in rows))


if __name__ == "__main__":
    main()
