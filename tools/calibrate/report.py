"""A calibration in words and as JSON."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import orjson

from tools.calibrate.result import Calibration
from tools.calibrate.verdict import centre_mm, focal_mm, share_covered


def to_text(result: Calibration) -> str:
    """Return the page."""
    lines: list[str] = []
    for k, camera in enumerate(result.cameras):
        fx, fy, cx, cy = camera.lens.intrinsics
        sx, sy, su, sv = camera.sigmas_px
        width, height = camera.size_px
        tilts = camera.lens.tilts_deg
        lines += [
            f"{camera.name}: {width} x {height} px, {len(camera.views)} views of {result.shown[k]} with the board, "
            f"coverage {100 * share_covered(camera):.0f} %, tilt {tilts.min():.0f} to {tilts.max():.0f} deg",
            f"  error         {camera.lens.rms_px:.3f} px fitted, {camera.held_out.rms_px:.3f} px held out; by view "
            f"{camera.lens.errors_px.min():.2f} to {camera.lens.errors_px.max():.2f} px (worst: {_worst(result, k)})",
            f"  focal length  {fx:.2f} +- {sx:.2f}, {fy:.2f} +- {sy:.2f} px: "
            f"{focal_mm(camera, result.distance_m):.1f} mm at {result.distance_m:g} m",
            f"  centre        {cx:.2f} +- {su:.2f}, {cy:.2f} +- {sv:.2f} px: "
            f"{centre_mm(camera, result.distance_m):.1f} mm",
            f"  distortion    {' '.join(f'{x:.4f}' for x in camera.lens.distortion)}",
        ]
        lines += [f"  NOT GOOD: {reason}" for reason in result.verdicts[k].against]
        lines += [f"  note: {note}" for note in result.verdicts[k].notes]
    lines += list(_pairs(result))
    lines.append("Good: next, posebridge calibrate room." if result.good else "Not good: see above what to mend.")
    return "\n".join(lines)


def to_json(result: Calibration) -> str:
    """Return the figures for programs."""
    cameras = [
        {
            "name": camera.name, "good": verdict.good, "against": list(verdict.against), "notes": list(verdict.notes),
            "size_px": list(camera.size_px), "intrinsics_px": camera.lens.intrinsics.tolist(),
            "sigmas_px": camera.sigmas_px.tolist(), "distortion": camera.lens.distortion.tolist(),
            "rms_px": camera.lens.rms_px, "held_out_px": camera.held_out.rms_px,
            "coverage": share_covered(camera), "focal_mm": focal_mm(camera, result.distance_m),
            "views": [
                {"name": view.name, "rms_px": float(fit), "held_out_px": float(held), "tilt_deg": float(tilt)}
                for view, fit, held, tilt in zip(
                    camera.views, camera.lens.errors_px, camera.held_out.errors_px, camera.lens.tilts_deg, strict=True
                )
            ],
        }
        for camera, verdict in zip(result.cameras, result.verdicts, strict=True)
    ]  # fmt: skip
    pairs = [
        {
            "names": list(pair.names), "good": verdict.good, "against": list(verdict.against),
            "pairs": len(pair.errors_px), "rms_px": pair.rms_px, "baseline_mm": 1e3 * pair.baseline_m,
            "joint": pair.joint, "focal_px": [float(K[0, 0]) for K in pair.K],
        }
        for pair, verdict in result.pairs
    ]  # fmt: skip
    return orjson.dumps({"good": result.good, "cameras": cameras, "pairs": pairs}, option=orjson.OPT_INDENT_2).decode()


def _pairs(result: Calibration) -> Iterator[str]:
    for pair, verdict in result.pairs:
        turn_deg = np.degrees(np.arccos(np.clip((np.trace(pair.R_C0toC1) - 1) / 2, -1.0, 1.0)))
        how = (
            f"both lenses fitted anew, f {pair.K[0][0, 0]:.1f} and {pair.K[1][0, 0]:.1f} px"
            if pair.joint
            else "lenses kept"
        )
        yield (
            f"{' and '.join(pair.names)}: {len(pair.errors_px)} pairs, error {pair.rms_px:.3f} px, baseline "
            f"{1e3 * pair.baseline_m:.1f} mm, {turn_deg:.1f} deg apart; {how}"
        )
        yield from (f"  NOT GOOD: {reason}" for reason in verdict.against)


def _worst(result: Calibration, k: int) -> str:
    camera = result.cameras[k]
    return camera.views[int(np.argmax(camera.lens.errors_px))].name
