"""The colours in which results are drawn, in figures and in exported scenes."""

# Okabe-Ito colours: distinguishable with every kind of colour vision
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442")
PLANNED, HF, MF = "#9a9a9a", "#0072B2", "#E69F00"
INK, FAINT, ALARM = "#333333", "#d8d8d8", "#e00000"
