"""How MuJoCo's C engine hides physics in an arm: the plant, what is hidden in it, and the loop that drives it.

Nothing here uses this package's own dynamics or effects, so that a diagnosis is judged by code it doesn't share.
"""
