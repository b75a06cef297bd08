"""What a result folder holds."""

TABLES = (
    "rounds", "pings", "receptions", "broadcasts", "frame_receptions", "assignments", "fixes",
    "gnss_fixes", "tracks", "auvs", "mission",
)  # fmt: skip
