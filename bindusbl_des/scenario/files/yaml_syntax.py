"""What breaks the grammar of YAML, in plain words in place of the parser's."""

import yaml

from .mistakes import Place

# What the parsers (libyaml, PyYAML) say, and what it means to the author of the file.
_PROBLEMS = {
    "mapping values are not allowed": "a ':' where none can be; check the indentation and the line "
    "above, or put text that holds ': ' in quotes",
    "could not find expected ':'": "a key without ':'; write `key: value`, with a space",
    "did not find expected ','": "[ or { is not closed, or a comma is missing",
    "expected ',' or": "[ or { is not closed, or a comma is missing",
    "did not find expected node content": "[ or { is not closed, or a value is missing",
    "unexpected end of stream": "a quote is not closed",
    "did not find expected key": "the indentation fits no key above; align it",
    "expected <block end>": "the indentation fits no key above; align it",
    "did not find expected '-'": "the indentation fits no list item above; align it",
    "expected <document start>": "the indentation fits no key above; align it",
    "invalid Unicode character escape": "an escape of half a character (\\ud83d); write "
    "the character itself, or its one escape such as \\U0001f41f",
    "cannot start any token": "a character that starts no value (such as @ ` %); use quotes",
}


def syntax_mistake(error: yaml.YAMLError, text: str, file: str) -> tuple[Place, str]:
    """Return where YAML's grammar was broken and, in plain words, how."""
    if isinstance(error, yaml.reader.ReaderError):
        before = text[: error.position]
        column = error.position - before.rfind("\n")
        place = Place(file, before.count("\n") + 1, column)
        return place, "YAML syntax: a control character; is this a text file?"
    mark = getattr(error, "problem_mark", None)
    problem = str(getattr(error, "problem", None) or error).splitlines()[0]
    if mark is None:
        return Place(file), f"YAML syntax: {problem}"
    place = Place(file, mark.line + 1, mark.column + 1)
    lines = text.splitlines()
    line = lines[mark.line] if mark.line < len(lines) else ""
    indentation = line[: len(line) - len(line.lstrip())]
    if "\t" in indentation or line[mark.column : mark.column + 1] == "\t":
        return place, "YAML syntax: a tab in the indentation; use spaces"
    for part, words in _PROBLEMS.items():
        if part in problem:
            return place, f"YAML syntax: {words}"
    return place, f"YAML syntax: {problem}"
