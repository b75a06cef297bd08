"""Errors that outlast a ping: heading misalignment, slow GNSS, sound speed and clocks."""
