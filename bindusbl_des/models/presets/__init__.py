"""Figures of modems, USBLs and inertial systems that one can buy, each number with its source."""
