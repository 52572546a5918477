"""What is minimised, subject to what: small frozen dataclasses over arrays, one statement a file, no solver inside."""
