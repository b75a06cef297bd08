"""Wrong scenario files, each with the exact messages that it must get."""

HEAD = "name: m\n"
ROUTE = "auvs: {count: 2, route: "
ANGLE = "(>= -360 and <= 360 deg)"
TOP = (
    "name, duration_s, survey, auvs, asvs, environment, acoustics, protocol, usbl, navigation, "
    "traffic, modems, ..."
)

# Each file follows the line `name: m`, unless it begins with "!"; messages follow the file's name.
WRONG = {
    "unknown key": (
        "duration: 5\n",
        ["2:1: duration: unknown key; did you mean 'duration_s'?"],
    ),
    "unit left out": (
        "survey: {depth: 5}\n",
        ["2:10: survey.depth: unknown key; did you mean 'depth_m'?"],
    ),
    "wrong unit": (
        "auvs: {speed_knots: 5}\n",
        ["2:8: auvs.speed_knots: unknown key; did you mean 'speed_m_per_s'?"],
    ),
    "misspelt section": (
        "acustics: {hf: {range_m: 5}}\n",
        ["2:1: acustics: unknown key; did you mean 'acoustics'?"],
    ),
    "capitals": ("Survey: {}\n", ["2:1: Survey: unknown key; did you mean 'survey'?"]),
    "belongs to two sections": (
        "auvs: {range_m: 5}\n",
        ["2:8: auvs.range_m: unknown key; it belongs under acoustics.hf or acoustics.mf"],
    ),
    "belongs to another section": (
        "acoustics: {mf: {ping_s: 0.1}}\n",
        ["2:18: acoustics.mf.ping_s: unknown key; it belongs under acoustics.hf"],
    ),
    "section in the wrong place": (
        "hf: {range_m: 5}\n",
        ["2:1: hf: unknown key; it belongs under acoustics"],
    ),
    "unit left out, elsewhere": (
        "speed: 5\n",
        [
            "2:1: speed: unknown key; did you mean 'auvs.speed_m_per_s' or "
            "'asvs.formation.speed_m_per_s' or 'environment.wind.speed_m_per_s'?"
        ],
    ),
    "nonsense key": (
        "xyzzy: 5\n",
        [f"2:1: xyzzy: unknown key; remove it; the keys at the top level are {TOP}"],
    ),
    "key is a number": (
        "12: 5\n",
        ["2:1: 12: unknown key; a decimal comma? write a point, as in 1.12"],
    ),
    "key of another route": (
        ROUTE + "{kind: hold, positions_m: [[0, 0], [9, 9]], lane_spacing_m: 5}}\n",
        [
            "2:69: auvs.route.lane_spacing_m: no key of a hold route; "
            "it belongs to `kind: lawnmower`"
        ],
    ),
    "kind forgotten": (
        ROUTE + "{positions_m: [[0, 0], [9, 9]]}}\n",
        ["2:26: auvs.route.positions_m: no key of a lawnmower route; it belongs to `kind: hold`"],
    ),
    "unknown kind": (
        ROUTE + "{kind: lawnmowr}}\n",
        [
            "2:32: auvs.route.kind: must be one of lawnmower, hold, waypoints, track, "
            "module:object; "
            "got the text 'lawnmowr'; did you mean 'lawnmower'?"
        ],
    ),
    "kind far off, guessed by its keys": (
        ROUTE + "{kind: [1], positions_m: [[0, 0], [9]]}}\n",
        [
            "2:32: auvs.route.kind: must be one of lawnmower, hold, waypoints, track, "
            "module:object; got a list",
            "2:59: auvs.route.positions_m.1: needs two numbers [x, y]; got a list of 1",
        ],
    ),
    "route is a word": (
        "auvs: {route: lawnmower}\n",
        [
            "2:15: auvs.route: needs keys and values (kind, surface_every_s, surface_for_s, ...); "
            "got the text 'lawnmower'"
        ],
    ),
    "name missing": (
        "!duration_s: 5\n",
        ["1:1: name: missing; add it, such as `name: my_mission`"],
    ),
    "name misspelt is not missing too": (
        "!nmae: m\n",
        ["1:1: nmae: unknown key; did you mean 'name'?"],
    ),
    "name is a number": (
        "!name: 140\n",
        ["1:7: name: needs a text; got 140; put it in quotes: '140'"],
    ),
    "name is empty": (
        "!name: ''\n",
        ["1:7: name: must have 1 to 100 characters; got the text ''"],
    ),
    "name is null": (
        "!name:\n",
        ["1:6: name: needs a text; got nothing; give a value"],
    ),
    "too small": (
        "duration_s: 0\n",
        ["2:13: duration_s: must be >= 0.001 and <= 10000000 s; got 0"],
    ),
    "too large": (
        "acoustics: {loss: {cap: 1.5}}\n",
        ["2:25: acoustics.loss.cap: must be >= 0 and <= 1; got 1.5"],
    ),
    "infinite": (
        "asvs: {formation: {angle_deg: .inf}}\n",
        [f"2:31: asvs.formation.angle_deg: must be a finite number {ANGLE}; got inf"],
    ),
    "not a number": (
        "asvs: {formation: {angle_deg: .NaN}}\n",
        [f"2:31: asvs.formation.angle_deg: must be a finite number {ANGLE}; got nan"],
    ),
    "a number of 400 digits": (
        f"asvs: {{formation: {{angle_deg: {'9' * 400}}}}}\n",
        [f"2:31: asvs.formation.angle_deg: must be a finite number {ANGLE}; got inf"],
    ),
    "a count with a fraction": (
        "auvs: {count: 2.5}\n",
        ["2:15: auvs.count: needs a whole number (>= 1 and <= 100000); got 2.5"],
    ),
    "a count that is true": (
        "auvs: {count: true}\n",
        ["2:15: auvs.count: needs a whole number (>= 1 and <= 100000); got true"],
    ),
    "yes": (
        "duration_s: yes\n",
        ["2:13: duration_s: needs a number (>= 0.001 and <= 10000000 s); got the text 'yes'"],
    ),
    "on": (
        "duration_s: on\n",
        ["2:13: duration_s: needs a number (>= 0.001 and <= 10000000 s); got the text 'on'"],
    ),
    "clock time": (
        "duration_s: 12:30\n",
        [
            "2:13: duration_s: needs a number (>= 0.001 and <= 10000000 s); got the text '12:30'; "
            "clock times are not read, write one number"
        ],
    ),
    "date": (
        "duration_s: 2024-01-02\n",
        [
            "2:13: duration_s: needs a number (>= 0.001 and <= 10000000 s); "
            "got the text '2024-01-02'"
        ],
    ),
    "octal": (
        "auvs: {count: 0o17}\n",
        [
            "2:15: auvs.count: needs a whole number (>= 1 and <= 100000); got the text '0o17'; "
            "write 15"
        ],
    ),
    "leading zero": (
        "auvs: {count: 010}\n",
        [
            "2:15: auvs.count: needs a whole number (>= 1 and <= 100000); got the text '010'; "
            "write 10"
        ],
    ),
    "underscore": (
        "auvs: {count: 1_0}\n",
        [
            "2:15: auvs.count: needs a whole number (>= 1 and <= 100000); got the text '1_0'; "
            "write 10"
        ],
    ),
    "quoted number": (
        "auvs: {count: '3'}\n",
        [
            "2:15: auvs.count: needs a whole number (>= 1 and <= 100000); got the text '3'; "
            "remove the quotes"
        ],
    ),
    "unit in the value": (
        "auvs: {speed_m_per_s: 1.5 m/s}\n",
        [
            "2:23: auvs.speed_m_per_s: needs a number (>= 0.001 and <= 20 m/s); "
            "got the text '1.5 m/s'; write 1.5 alone, the unit is part of the key"
        ],
    ),
    "another unit in the value": (
        "duration_s: 3h\nauvs: {speed_m_per_s: 2 kn, count: 1-3}\n",
        [
            "2:13: duration_s: needs a number (>= 0.001 and <= 10000000 s); got the text '3h'; "
            "write 10800, it is in s",
            "3:23: auvs.speed_m_per_s: needs a number (>= 0.001 and <= 20 m/s); "
            "got the text '2 kn'; write 1.02888889, it is in m/s",
            "3:36: auvs.count: needs a whole number (>= 1 and <= 100000); got the text '1-3'; "
            "a range to vary is written 1:3",
        ],
    ),
    "decimal comma": (
        "duration_s: 1,5\n",
        [
            "2:13: duration_s: needs a number (>= 0.001 and <= 10000000 s); got the text '1,5'; "
            "write the decimal point as 1.5"
        ],
    ),
    "null number": (
        "acoustics: {loss: {cap: ~}}\n",
        [
            "2:25: acoustics.loss.cap: needs a number (>= 0 and <= 1); got nothing; "
            "give a value or remove the key (default 0.999)"
        ],
    ),
    "wrong choice": (
        "auvs: {vehicle: kinmatic}\n",
        [
            "2:17: auvs.vehicle: must be one of kinematic, remus100, bluerov2; "
            "got the text 'kinmatic'; did you mean 'kinematic'?"
        ],
    ),
    "null for none": (
        "acoustics: {loss: {law: null}}\n",
        [
            "2:25: acoustics.loss.law: must be one of scaled, paper, thesis, head, none; got "
            "nothing; did you mean 'none'?"
        ],
    ),
    "section is empty": (
        "survey:\n",
        [
            "2:8: survey: is empty; indent its keys (side_m, size_m, rotation_deg, ...) under it, "
            "or remove it"
        ],
    ),
    "section is a list": (
        "survey: [1, 2]\n",
        ["2:9: survey: needs keys and values (side_m, size_m, rotation_deg, ...); got a list"],
    ),
    "point of three": (
        "navigation: {velocity_bias_m_per_s: [1, 2, 3]}\n",
        ["2:37: navigation.velocity_bias_m_per_s: needs two numbers [x, y]; got a list of 3"],
    ),
    "point is a number": (
        "navigation: {velocity_bias_m_per_s: 1}\n",
        ["2:37: navigation.velocity_bias_m_per_s: needs [x, y]; got 1"],
    ),
    "point beyond the sea": (
        "asvs: {count: 1, formation: {positions_m: [[1, 1e7]]}}\n",
        ["2:48: asvs.formation.positions_m.0.1: must be <= 1000000 m; got 10000000"],
    ),
    "flat list of points": (
        "asvs: {count: 1, formation: {positions_m: [1, 2]}}\n",
        [
            "2:44: asvs.formation.positions_m.0: needs [x, y]; got 1",
            "2:47: asvs.formation.positions_m.1: needs [x, y]; got 2",
        ],
    ),
    "given twice": (
        "duration_s: 5\nduration_s: 6\n",
        ["3:1: duration_s: given twice, first in line 2; keep one"],
    ),
    "section given twice, both are checked": (
        "survey: {side_m: 5}\nsurvey: {depth_m: on}\n",
        [
            "3:1: survey: given twice, first in line 2; keep one",
            "3:19: survey.depth_m: needs a number (>= 0 and <= 11000 m); got the text 'on'",
        ],
    ),
    "python tag": (
        "duration_s: !!python/object/apply:os.system ['touch broken']\n",
        [
            "2:13: duration_s: tag !!python/object/apply:os.system is not allowed; "
            "write the plain value"
        ],
    ),
    "float tag": (
        "duration_s: !!float 5\n",
        ["2:13: duration_s: tag !!float is not allowed; write the plain value"],
    ),
    "anchor and alias": (
        "duration_s: &a 5\nsurvey: {side_m: *a}\n",
        [
            "2:13: duration_s: anchor &a is not allowed; remove it",
            "3:18: survey.side_m: alias *a is not allowed; write the value out",
        ],
    ),
    "merge key": (
        "survey: {<<: {side_m: 5}}\n",
        ["2:10: survey: merge keys (<<) are not allowed; write the keys out"],
    ),
    "key is a list": ("? [1, 2]\n: 3\n", ["2:3: a key must be a plain word"]),
    "two documents": (
        "---\nname: n\n",
        ["2:1: a second document (---) begins here; keep one per file"],
    ),
    "empty": ("!", ["1:1: the file is empty; a scenario needs at least `name: my_mission`"]),
    "comments only": (
        "!# nothing\n",
        ["1:1: the file is empty; a scenario needs at least `name: my_mission`"],
    ),
    "a list": (
        "!- name: m\n",
        ["1:1: must hold keys and values such as `name: my_mission`; it holds a list"],
    ),
    "a word": (
        "!mission\n",
        ["1:1: must hold keys and values such as `name: my_mission`; it holds a single value"],
    ),
    "tab": (
        "survey:\n\tside_m: 5\n",
        ["3:1: YAML syntax: a tab in the indentation; use spaces"],
    ),
    "two colons": (
        "duration_s: 5: 6\n",
        [
            "2:14: YAML syntax: a ':' where none can be; check the indentation and the line above, "
            "or put text that holds ': ' in quotes"
        ],
    ),
    "open bracket": (
        "survey: {side_m: 5\n",
        ["3:1: YAML syntax: [ or { is not closed, or a comma is missing"],
    ),
    "open quote": ("schedule: 'on\n", ["3:1: YAML syntax: a quote is not closed"]),
    "bad indentation": (
        "survey:\n  side_m: 5\n depth_m: 5\n",
        ["4:2: YAML syntax: the indentation fits no key above; align it"],
    ),
    "control character": (
        "a: \x00\n",
        ["2:4: YAML syntax: a control character; is this a text file?"],
    ),
    "nested without end": (
        f"survey: {'[' * 500_000}\n",
        ["2:29: survey.0.0: nested deeper than 20 levels"],
    ),
    "positions for another fleet": (
        ROUTE + "{kind: hold, positions_m: [[0, 0]]}}\n",
        ["2:51: auvs.route.positions_m: needs one [x, y] per AUV: 2 expected, 1 given"],
    ),
    "origin beyond the pole": (
        "environment: {origin: {lat_deg: 91, lon_deg: 0}}\n",
        ["2:33: environment.origin.lat_deg: must be >= -90 and <= 90 deg; got 91"],
    ),
    "half an origin": (
        "environment: {origin: {lat_deg: 54}}\n",
        ["2:33: environment.origin.lat_deg: needs lon_deg as well; add it"],
    ),
    "two formations": (
        "asvs: {count: 1, formation: {positions_m: [[0, 0]], radius_m: 5}}\n",
        [
            "2:43: asvs.formation.positions_m: excludes radius_m, clearance_m and angle_deg; "
            "keep one or the other"
        ],
    ),
    "an ASV that there is not fails": (
        "asvs: {count: 2, failures: [{asv: 0, at_s: 9}, {asv: 2, at_s: 5}]}\n",
        ["2:54: asvs.failures.1.asv: there is no ASV2: the last is ASV1"],
    ),
    "a failure over before it begins": (
        "asvs: {failures: [{asv: 1, at_s: 5, until_s: 4}]}\n",
        ["2:46: asvs.failures.0.until_s: must be later than at_s, which is 5 s; got 4"],
    ),
    "an ASV fails that has failed": (
        "asvs: {failures: [{asv: 1, at_s: 5}, {asv: 1, at_s: 9}]}\n",
        [
            "2:53: asvs.failures.1.at_s: ASV1 fails while it has failed already (failure 0); make "
            "one of both"
        ],
    ),
    "unknown key of a failure": (
        "asvs: {failures: [{asv: 1, at_s: 5, untl_s: 6}]}\n",
        ["2:37: asvs.failures.0.untl_s: unknown key; did you mean 'until_s'?"],
    ),
    "a failure before the mission": (
        "asvs: {failures: [{asv: 1, at_s: -2}]}\n",
        ["2:34: asvs.failures.0.at_s: must be >= 0 s; got -2"],
    ),
    "a failure that is a number": (
        "asvs: {failures: [1]}\n",
        ["2:19: asvs.failures.0: needs keys and values (asv, at_s, until_s, ...); got 1"],
    ),
    "a hull whose name is a list": (
        "auvs: {vehicle: {model: [kinematic]}}\n",
        [
            "2:17: auvs.vehicle: must be one of kinematic, remus100, bluerov2; got a list; did you "
            "mean 'kinematic'?"
        ],
    ),
    "default that contradicts a key": (
        "survey: {side_m: 9}\nauvs: {vehicle: {model: kinematic, turning_radius_m: 1}}\n",
        [
            "2:18: auvs.route.lane_spacing_m: leaves no lane: margins of 2 x 5 m fill the side of "
            "9 m; use a smaller one"
        ],
    ),
    "unknown schedule": (
        "protocol: {schedule: spatial_resue}\n",
        [
            "2:22: protocol.schedule: 'spatial_resue' is no schedule; did you mean "
            "'spatial_reuse'? (one of spatial_reuse, dsatur, one_per_slot, round_robin, random, "
            "worst_first, polling, super_tdma, aloha, slotted_aloha, csma, or your own as "
            "module:object)"
        ],
    ),
    "a preset in a part's place": (
        "usbl: {model: cerulean_rovl}\n",
        [
            "2:15: usbl.model: 'cerulean_rovl' is no instrument (one of array, datasheet, or your "
            "own as module:object); it is a preset: set usbl.preset to cerulean_rovl"
        ],
    ),
    "too many samples": (
        "duration_s: 1e7\nrecord: {metrics_hz: 1, tracks_hz: 1}\n",
        [
            "2:13: navigation.imu_rate_hz: 1.8e+09 samples (1e+07 s x 30 Hz x 6 vehicles) exceed "
            "5e+08; lower rate, duration or fleet"
        ],
    ),
}


def text_of(case: str) -> str:
    """Return the text of a wrong file."""
    body = WRONG[case][0]
    return body[1:] if body.startswith("!") else HEAD + body
