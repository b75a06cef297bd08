"""Which of many candidates meets a goal at the least cost, with a stated confidence."""
