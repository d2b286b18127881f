"""``python -m focgen`` is ``focgen``."""

from focgen.cli.main import main

raise SystemExit(main())
