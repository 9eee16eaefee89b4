"""What the benchmark workloads cost on this machine.

Run: python experiments/bench/measure.py W2 [--json], with sheetbend[cli] installed; `--help` names the workloads.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from sheetbend.cli.outcome import Code, Outcome, run
from sheetbend.cli.screen import heading
from sheetbend.errors import InputError
from sheetbend_bench import WORKLOADS, measure, workload
from sheetbend_bench.bodies import measure_bodies
from sheetbend_bench.chain import measure_chain
from sheetbend_bench.cloth import measure_cloth
from sheetbend_bench.ladder import measure_ladder
from sheetbend_bench.rod import measure_rod

NAMES = (*WORKLOADS, "chain", "bodies", "rod", "cloth", "ladder")


def bench(
    name: Annotated[
        str,
        typer.Argument(
            metavar="WORKLOAD",
            help="W1 a rope, W1s the same in small steps, W2 a cloth, W5 256 ropes, chain the direct solver, bodies a "
            "chain of hinged bodies beside it, rod a rope of 12 markers between grips, cloth sheets with strain and "
            "bending, ladder cloths of 441 to 1,000,000 particles.",
            show_default=False,
        ),
    ],
    threads: Annotated[int, typer.Option(help="Threads of the solver.")] = 1,
    repeats: Annotated[int, typer.Option(help="Runs after the warm-up; the median counts.")] = 5,
    frames: Annotated[
        int | None, typer.Option(help="Only the first frames of W1, W1s, W2 or W5.", show_default=False)
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(help="Draw the ladder into this file (png, svg, pdf).", show_default=False)
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="One JSON object on stdout; everything else goes to stderr.")
    ] = False,
) -> None:
    """Measure a benchmark workload: ns per projection forward and with the gradient, its error, peak memory; exit 5
    where the gradient is off."""
    run(lambda console: _bench(console, name, threads, repeats, frames, figure), json)


def _bench(console: Console, name: str, threads: int, repeats: int, frames: int | None, figure: Path | None) -> Outcome:
    _check(name, threads, repeats, frames, figure)
    if name == "chain":
        data = measure_chain(threads, repeats)
        _print_chain(console, data)
    elif name == "bodies":
        data = measure_bodies(threads, repeats)
        _print_bodies(console, data)
    elif name == "rod":
        data = measure_rod(threads, repeats)
        _print_rod(console, data)
    elif name == "cloth":
        data = measure_cloth(threads, repeats, progress=lambda row: _print_sheet(console, row))
        _print_swatches(console, data)
    elif name == "ladder":
        data = measure_ladder(threads, repeats, progress=lambda row: _print_rung(console, row))
        if figure is not None:
            from sheetbend_bench.figure import draw_ladder

            draw_ladder(data, figure)
            console.print(f"written to {figure}")
    else:
        w = workload(name)
        data = measure(w if frames is None else w.shortened(frames), threads, repeats)
        _print_workload(console, data)
    passed = data["gradient_error"] <= data["gradient_error_bound"]
    console.print(
        f"  gradient error {data['gradient_error']:.1e} against complex step, at most "
        f"{data['gradient_error_bound']:.0e}{'' if passed else '  <- fails'}; peak memory {data['peak_mb']:,.0f} MB",
        soft_wrap=True,
    )
    return Outcome(data, Code.DONE if passed else Code.CHECK_FAILED)


def _check(name: str, threads: int, repeats: int, frames: int | None, figure: Path | None) -> None:
    if name not in NAMES:
        raise InputError("WORKLOAD", "is unknown", name, f"use one of: {', '.join(NAMES)}")
    for option, value in (("--threads", threads), ("--repeats", repeats)):
        if value < 1:
            raise InputError(option, "must be a positive whole number", value, "give at least 1")
    if frames is not None and name not in WORKLOADS:
        raise InputError("--frames", f"does not apply to {name}", frames, f"use it with {', '.join(WORKLOADS)}")
    if figure is not None and name != "ladder":
        raise InputError("--figure", f"does not apply to {name}", str(figure), "use it with ladder")


def _print_workload(console: Console, data: Mapping[str, Any]) -> None:
    scenes = "one scene" if data["scenes"] == 1 else f"{data['scenes']} scenes"
    heading(
        console,
        data["workload"],
        f"{scenes}, {data['particles']:,} particles, {data['colors']} colors in the workload's own order, "
        f"{data['projections']:,} projections",
    )
    console.print(f"  {_conditions(data)}, {data['repeats']} runs")
    console.print("  ns per projection   median   fastest   on the processor")
    for name in ("forward", "gradient"):
        console.print(
            f"  {name:17s} {data[f'{name}_ns']:8.2f}  {data[f'{name}_ns_min']:8.2f}  {data[f'{name}_cpu_ns']:8.2f}"
        )


def _print_chain(console: Console, data: Mapping[str, Any]) -> None:
    heading(console, "chain", f"ropes on the direct solver; {_conditions(data)}")
    console.print("  segments  substeps   forward  gradient  ratio   (ns per segment and substep)")
    for row in data["rows"]:
        console.print(
            f"  {row['segments']:8,}  {row['substeps']:8,}  {row['forward_ns']:8.0f}  {row['gradient_ns']:8.0f}"
            f"  {row['gradient_ns'] / row['forward_ns']:5.2f}"
        )
    b = data["batch"]
    for name in ("forward", "gradient"):
        console.print(
            f"  {b['ropes']} ropes of {b['segments']} segments, {name}: {b[f'{name}_ns']:.0f} in one batch, "
            f"{b[f'{name}_singly_ns']:.0f} one at a time, {b[f'{name}_speedup']:.1f} times the throughput",
            soft_wrap=True,
        )


def _print_bodies(console: Console, data: Mapping[str, Any]) -> None:
    heading(console, "bodies", f"hinged bodies on the direct solver, beside ropes; {_conditions(data)}")
    console.print(
        "    bodies   segment      body  ratio  gradient/forward   (ns on the processor, per one and substep)"
    )
    for row in data["rows"]:
        segment, body = row["segment_forward_cpu_ns"], row["forward_cpu_ns"]
        console.print(
            f"  {row['bodies']:8,}  {segment:8.0f}  {body:8.0f}  {body / segment:5.1f}"
            f"  {row['gradient_cpu_ns'] / body:16.2f}"
        )


def _print_rod(console: Console, data: Mapping[str, Any]) -> None:
    heading(console, "rod", f"12 markers between two grips; {_conditions(data)}")
    forward = data["forward_ns"]
    for name, words in (
        ("forward", "forward, one iteration"),
        ("two_iterations", "forward, two iterations"),
        ("gradient", "gradient"),
        ("jacobian", "Jacobian, 8 columns"),
    ):
        each = data[f"{name}_ns"]
        console.print(f"  {words:24s} {each / 1000:6.2f} us per substep, {each / forward:5.2f} times forward")
    for name in ("forward", "gradient"):
        batch, singly = data[f"{name}_batch_ns"], data[f"{name}_singly_ns"]
        console.print(
            f"  8 recordings, {name}: {batch / 1000:.2f} us in lanes, {singly / 1000:.2f} one at a time, "
            f"{singly / batch:.1f} times the throughput",
            soft_wrap=True,
        )


def _print_sheet(console: Console, row: Mapping[str, Any], label: str = "strain and hinges") -> None:
    console.print(
        f"  {row['particles']:7,} vertices, {label}: {row['forward_step_ms']:8.2f} ms per substep forward, "
        f"{row['gradient_step_ms']:8.2f} with the gradient; {row['forward_cpu_ns']:.1f} and "
        f"{row['gradient_cpu_ns']:.1f} ns per projection",
        soft_wrap=True,
    )


def _print_swatches(console: Console, data: Mapping[str, Any]) -> None:
    swatch = data["swatch"]
    _print_sheet(console, swatch["curvature"], "strain and sheet_curvature")
    _print_sheet(console, swatch["newton"], "the same by Newton, 2 iterations")
    b = swatch["batch"]
    for name in ("forward", "gradient"):
        console.print(
            f"  {b['sheets']} swatches, {name}: {b[f'{name}_cpu_ns']:.1f} ns per projection in one batch, "
            f"{b[f'{name}_singly_cpu_ns']:.1f} one at a time, {b[f'{name}_speedup']:.1f} times the throughput",
            soft_wrap=True,
        )


def _print_rung(console: Console, row: Mapping[str, Any]) -> None:
    console.print(
        f"  {row['particles']:9,} particles, {row['colors']} colors, {row['substeps']:,} substeps: "
        f"{row['forward_ns']:6.2f} ns per projection forward, {row['gradient_ns']:6.2f} with the gradient, "
        f"{row['peak_mb']:,.0f} MB",
        soft_wrap=True,
    )


def _conditions(data: Mapping[str, Any]) -> str:
    threads = "1 thread" if data["threads"] == 1 else f"{data['threads']} threads"
    return f"{threads}, {data['lanes']} lanes, {data['isa']}, {data['machine']['processor']}"


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
app.command()(bench)

if __name__ == "__main__":
    app()
