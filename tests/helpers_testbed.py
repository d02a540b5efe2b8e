"""Stored lines of a diagnosis and its truth, written by hand: joints a and b."""


def finding(effect, joints, p=0.99, alternatives=(), **parameters):
    return {"effect": effect, "joints": list(joints), "evidence": {"probability": p},
            "parameters": {k: {"value": v, "std": s} for k, (v, s) in parameters.items()},
            "alternatives": [{"effect": a} for a in alternatives]}  # fmt: skip


def hidden(slug, joints, accept=(), tolerate=(), role="special", unnamed=False, **parameters):
    return {"kind": slug or "odd", "slug": slug, "joints": list(joints), "parameters": parameters, "role": role,
            "accept": [*([slug] if slug else []), *accept], "tolerate": list(tolerate), "unnamed": unnamed}  # fmt: skip


def line(findings, truth, verdict="physics_left_out", unexplained=(), not_testable=(), dead=(), notes=()):
    fit = {joint: {"noise_floor": floor} for joint, floor in (("a", 0.3), ("b", 0.1))}
    said = {"verdict": verdict, "findings": findings, "unexplained": list(unexplained), "notes": list(notes),
            "not_testable": list(not_testable), "fit": fit}  # fmt: skip
    return {"diagnosis": said, "truth": {"hidden": truth, "dead": list(dead), "torque": {"a": 2.0, "b": 1.0}},
            "noise_in_band": {"a": 0.1, "b": 0.1},
            "unseen": {"refit": {"a": 2.0, "b": 1.0}, "corrected": {"a": 1.0, "b": 0.5}}}  # fmt: skip
