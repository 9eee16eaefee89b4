"""python -m sheetbend"""

from .cli import main

main()
