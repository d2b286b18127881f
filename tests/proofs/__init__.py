"""What verifiers of C prove of generated controllers, and a fuzzer's target; ``python -m tests.proofs``."""
