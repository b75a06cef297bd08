// Plots are printed too: uPlot, which asks once, draws at least two dots for each pixel.
const ownRatio = Object.getOwnPropertyDescriptor(window, "devicePixelRatio");
Object.defineProperty(window, "devicePixelRatio", { configurable: true, value: Math.max(devicePixelRatio, 2) });
