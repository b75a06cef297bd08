"""The MF band: fixes in frames, from ASVs to AUVs.

Theory of operation
-------------------
A frame that begins at t and lasts T_A reaches the AUVs that are in range at t.  At an AUV it begins
when its front has come, and ends when the sound of its end has, from where the vessel is by then.
What decodes it hands it over `processing_s` later: the fixes that it carries are delivered then.

`downlink.MfDownlink.send` notes the frame, and tells each of its fixes when it will arrive.  Where
the AUV's way is not known, an event waits until the end of the frame is nearly there.

What becomes of a frame at an AUV (`reception.receive`) is worked out when somebody asks: it is cut
where the vessel failed; lost by the channel; destroyed by a frame that overlaps it, or by the AUV's
own ping where it has one transducer (`duplex: per_node`); else heard.  Nothing is asked as long as
no two frames have ever been on the air at once.

Fixes are delivered in the order of their arrival, not of sending: a frame from nearby overtakes one
from afar.  An AUV that steers by its fixes has each at its own instant; the others' are delivered
together when somebody wants to know, and come to the same, bit for bit.
"""
