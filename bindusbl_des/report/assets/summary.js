"use strict";
// A page without events: text and tables only.

startTheme();
bindusbl.ready = true;
