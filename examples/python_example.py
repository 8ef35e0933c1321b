"""Screen one blade for rubbing at its leading and trailing edge, in this process.

Run: python examples/python_example.py
"""

from __future__ import annotations

from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from service.screening.screen import screen
from service.speeds import SpeedRange
from training.screening import Screener


def main() -> None:
    """Print where NASA rotor 37 first becomes unstable."""
    report = screen(
        [example_blade("nasa_rotor_37")],
        {
            "leading edge": ContactConfiguration.at("LE"),
            "trailing edge": ContactConfiguration.at("TE"),
        },
        Screener.default(),
        speed_range=SpeedRange.parse("12000rpm:18000rpm"),
        ke_liner=12_000.0,
        map_shape=(50, 50),
    )
    for row in report.results:
        if row.worst is None:
            print(f"{row.contact_name}: none below {row.ke_max:,.0f} N/m, {row.verdict}")
        else:
            print(
                f"{row.contact_name}: {row.worst.ke:,.0f} N/m at {row.worst.speed_rpm:,.0f} rpm, "
                f"chatter at {row.worst.chatter_hz:.0f} Hz, {row.verdict}"
            )


if __name__ == "__main__":
    main()
