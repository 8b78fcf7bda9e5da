"""Page as Markdown, with its figures as separate files."""

from collections.abc import Iterator, Sequence
from html import escape

from a7sim.report.drawing import standalone
from a7sim.report.page import Chapter, Details, Heading, PageFigure, Paragraph, Part, TableBlock


def markdown(
    title: str, lead: Sequence[Part], chapters: Sequence[Chapter], figures_at: str
) -> tuple[str, dict[str, str]]:
    """Return the contents of `page.page` as Markdown, and its figures as standalone SVG, by file name.

    `figures_at` is the prefix of their addresses in the Markdown.
    """
    figures: dict[str, str] = {}
    blocks = [f"# {title}", *_blocks(lead, figures_at, figures)]
    for chapter in chapters:
        blocks += [f"## {chapter.title}", *_blocks(chapter.parts, figures_at, figures)]
    return "\n\n".join(blocks) + "\n", figures


def _blocks(parts: Sequence[Part], figures_at: str, figures: dict[str, str]) -> Iterator[str]:
    for part in parts:
        match part:
            case Heading(text):
                yield f"### {text}"
            case Paragraph(text, loud):
                lines = [f"**{line}**" if loud else line for line in text.splitlines()]
                yield "\n".join(f"- {line}" for line in lines) if len(lines) > 1 else "".join(lines)
            case TableBlock():
                yield from _table(part)
            case PageFigure():
                name, figures_svg = standalone(part)
                figures[f"{name}.svg"] = figures_svg
                yield f"![{part.caption}]({figures_at}{name}.svg)"
                yield f"*{part.caption}.*"
            case Details(summary, inner):
                yield f"<details><summary>{escape(summary)}</summary>"
                yield from _blocks(inner, figures_at, figures)
                yield "</details>"


def _table(sheet: TableBlock) -> Iterator[str]:
    yield f"*{sheet.caption}.*"
    ruler = [":---" if i in sheet.left else "---:" for i in range(len(sheet.columns))]
    rows = (sheet.columns, ruler, *sheet.rows)
    yield "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in row)} |" for row in rows)
