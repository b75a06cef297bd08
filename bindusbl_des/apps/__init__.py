"""What reasons about missions: before one, after one, about many; pages, exports, commands."""
