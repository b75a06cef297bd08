"""Random access: programs that vehicles run, by the verbs of `...core.protocol.access.node`."""
