"""What is done with functions of a program: fits, second derivatives, pictures."""
