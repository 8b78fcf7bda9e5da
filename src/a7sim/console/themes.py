"""The colours of the console: Wild's green-grey enamel, black drums with ivory digits, one warm accent."""

from collections.abc import Mapping

from textual.theme import Theme

DRUMS: Mapping[str, str] = {
    "drum": "#16181a",
    "ivory": "#f2ead2",
    "decimals": "#d9b46a",
    "engraving": "#2b352f",
    "faint": "#56645b",
    "mark": "#ffd23f",
    "eyepiece": "#000000",
}
"""What every theme says beside the usual colours, as `enamel` has it."""

THEMES = (
    Theme(
        name="enamel",
        primary="#3d5347",
        secondary="#52695c",
        accent="#c4561a",
        warning="#9a5a00",
        error="#a02418",
        success="#2f6b3c",
        foreground="#1b221e",
        background="#a9b8ac",
        surface="#b4c2b6",
        panel="#9caca0",
        dark=False,
        variables=dict(DRUMS),
    ),
    Theme(
        name="dark",
        primary="#7f9a8a",
        secondary="#5d7568",
        accent="#f0883e",
        warning="#d9a441",
        error="#f26d5b",
        success="#7fb685",
        foreground="#cfd8d1",
        background="#141816",
        surface="#1b211e",
        panel="#242c28",
        dark=True,
        variables={**DRUMS, "drum": "#050606", "engraving": "#9fb0a5", "faint": "#7c8b82"},
    ),
    Theme(
        name="light",
        primary="#4a5f53",
        secondary="#6c8074",
        accent="#b8480c",
        warning="#8a5200",
        error="#a31515",
        success="#24632f",
        foreground="#1c211e",
        background="#f4f5f1",
        surface="#fbfbf8",
        panel="#e6e9e3",
        dark=False,
        variables={**DRUMS, "drum": "#2a2d2b", "engraving": "#33413a", "faint": "#68756d"},
    ),
    Theme(
        name="contrast",
        primary="#ffffff",
        secondary="#ffffff",
        accent="#ffff00",
        warning="#ffff00",
        error="#ff6060",
        success="#60ff60",
        foreground="#ffffff",
        background="#000000",
        surface="#000000",
        panel="#000000",
        dark=True,
        variables={
            **DRUMS,
            "drum": "#000000",
            "ivory": "#ffffff",
            "decimals": "#ffff00",
            "engraving": "#ffffff",
            "faint": "#d0d0d0",
            "mark": "#ffff00",
        },
    ),
)
