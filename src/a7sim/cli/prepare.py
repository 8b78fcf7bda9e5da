"""`a7sim prepare`: the settings for a flight, before a picture is mounted."""

from typing import Any

import click
import msgspec
from rich.console import Console, Group, RenderableType
from rich.text import Text

from a7sim.cli import options
from a7sim.operator.mapping.preparation import FlightPlan, FlightSettings, ModelScale, choose_settings
from a7sim.plotters import VARIANTS
from a7sim.result_documents import as_json, document_header
from a7sim.text_tables import text_table


@click.command("prepare")
@options.principal_distance(required=True)
@click.option(
    "--photo-scale", type=options.greater_than(0.0), help="Scale number of the photographs at the mean ground."
)
@click.option(
    "--flying-height",
    type=options.greater_than(0.0),
    help="Height above the mean ground, m, in place of the photo scale.",
)
@click.option("--photo-base", type=options.greater_than(0.0), required=True, help="Base in the photograph, mm.")
@click.option("--heights", type=options.HEIGHT, nargs=2, required=True, help="Lowest and highest ground, m.")
@options.map_scale
@options.variant("A7")
@options.as_document
def command(
    c: float,
    photo_scale: float | None,
    flying_height: float | None,
    photo_base: float,
    heights: tuple[float, float],
    map_scale: float | None,
    variant: str,
    as_document: bool,
) -> None:
    """Choose model scale, gears, projection height and bx for a flight (thesis 3.2.3).

    Example: a7sim prepare --c 152.676 --photo-scale 8000 --photo-base 91 --heights 430.24 487.92 --map-scale 2500
    """
    flight = FlightPlan.of_heights(c, photo_base, heights, photo_scale, flying_height)
    settings = choose_settings(flight, VARIANTS[variant], map_scale)
    if as_document:
        click.echo(as_json(_document(settings, variant)), nl=False)
    else:
        Console().print(_settings_sheet(settings, variant, map_scale))


def _document(settings: FlightSettings, variant: str) -> dict[str, Any]:
    flight = settings.flight
    return (
        document_header("prepare")
        | {"variant": variant}
        | {
            "flight": msgspec.to_builtins(flight)
            | {
                "flying_height": round(flight.flying_height, 3),
                "above_ground": [round(flight.lowest_flown, 3), round(flight.highest_flown, 3)],
                "field_angle_deg": round(flight.field_angle_deg, 2),
            },
            "optimum": {"number": round(settings.optimum, 3), "bx": round(settings.optimum_bx, 2)},
            "scales": [_scale_document(scale) for scale in settings.scales],
            "chosen": _scale_document(settings.chosen),
            "reason": settings.reason,
        }
    )


def _scale_document(scale: ModelScale) -> dict[str, Any]:
    rounded = {name: round(value, 3) if isinstance(value, float) else value for name, value in vars(scale).items()}
    return rounded | {"against": list(scale.reason_rejected)}


def _settings_sheet(settings: FlightSettings, variant: str, map_scale: float | None) -> RenderableType:
    flight, chosen = settings.flight, settings.chosen
    table = text_table("model scale", "gear", "last digit, m", "plan", "Z, mm", "bx, mm", "", left=(0, 6), fold=(6,))
    for scale in settings.scales:
        table.add_row(
            f"1:{scale.number:.0f}",
            scale.height_gear,
            f"{scale.interval:g}",
            scale.plan_gear,
            f"{scale.lowest:.1f}-{scale.highest:.1f}",
            f"{scale.bx:.2f}",
            "chosen" if scale == chosen else "; ".join(scale.reason_rejected),
        )
    to_map = f", {chosen.plan_gear} to the map 1:{map_scale:.0f}" if map_scale is not None else ""
    return Group(
        Text(f"Settings for an {variant}", style="bold"),
        Text(
            f"Flown {flight.flying_height:.3f} m above {flight.mean_ground:.2f} m, {flight.lowest_flown:.3f} to "
            f"{flight.highest_flown:.3f} m above the ground; {flight.angle} angle, {flight.field_angle_deg:.1f} degrees"
        ),
        Text(f"Optimum model scale 1:{settings.optimum:.1f}, which requires bx {settings.optimum_bx:.2f} mm\n"),
        table,
        Text(f"\nModel scale         1:{chosen.number:.0f}: {settings.reason}"),
        Text(f"Gears               {chosen.height_gear} for heights in {chosen.interval:g} m{to_map}"),
        Text(f"Projection height   {chosen.projection_height:.3f} mm"),
        Text(f"bx                  {chosen.bx:.2f} mm, from the photo base"),
    )
