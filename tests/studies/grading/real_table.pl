#!/usr/bin/perl
# real_table.pl TABLE GRADES: the programs of real_programs.txt that have been graded, as Markdown: points lost by part, what was named and
# located, whether that is what stands in the table, and the commit of the assay that graded it. Exits 1 if a right program lost points
# or a wrong name was told.
use strict;
use warnings;
use JSON::PP;

my ($table, $grades) = @ARGV;
my (%told, @rows);
open my $in, '<', $table or die "$table: $!\n";
while (<$in>) {
    chomp;
    my ($kind, $name, @rest) = split ' ';
    next if !defined $kind || /^[ #]/ || $kind eq 'base';
    if ($kind eq 'right') {
        push @rows, { id => $name, kind => 'right', parts => [], names => [], what => join ' ', @rest[1 .. $#rest] };
    } elsif ($kind eq 'pair' || $kind eq 'drawn') {
        my @two = map { $told{$_} // die "$table: no bug $_\n" } $name, $rest[0];
        push @rows, { id => "$name+$rest[0]", kind => $kind, parts => [map { @{ $_->{parts} } } @two], names => [map { @{ $_->{names} } } @two],
            held => $kind eq 'drawn' || $two[0]{held} || $two[1]{held}, what => join ' and ', map { $_->{what} } @two };
    } else {
        push @rows, $told{$name} = { id => $name, kind => 'bug', parts => [$rest[1]], names => [$rest[2]], held => $kind eq 'held',
            what => join ' ', @rest[3 .. $#rest] };
    }
}

my (%of, %parts, @lines);
for my $row (@rows) {
    open my $f, '<', "$grades/$row->{id}/grade.json" or next;
    my $g = decode_json(do { local $/; <$f> });
    my %lost = map { $_->{number} => $_->{of} - $_->{points} } grep { $_->{points} < $_->{of} - 1e-9 } @{ $g->{parts} };
    $parts{ $_->{number} } = $_->{of} for @{ $g->{parts} };
    my %own = map { $_ => 1 } @{ $row->{parts} };
    # What explains all images; else what explains those of a part.
    my $diagnosis = $g->{diagnosis} // {};
    my @told = @{ $diagnosis->{named} // [] } ? ($diagnosis->{named}) : map { $_->{named} } @{ $diagnosis->{parts} // [] };
    my @found = map { [map { [$_->{name}, ($_->{and} // ())] } @$_] } grep { @$_ } @told;
    my %names = map { $_ => 1 } map { @$_ } map { @$_ } @found;
    my @want = grep { $_ ne '-' } @{ $row->{names} };
    my $named = @want == @{ $row->{names} } && @want && !grep { !$names{$_} } @want;
    # Where several are told that no image tells apart, one of them has to be right.
    my $right = sub { !grep { my $name = $_; !grep { $_ eq $name } @want } @{ $_[0] } };
    my $wrong = grep { !grep { $right->($_) } @$_ } @found;
    my $only = %lost && !grep { !$own{$_} } keys %lost;
    my $all = !grep { !$lost{$_} } keys %own;
    my $c = $of{ $row->{kind} } //= {};
    $c->{n}++;
    $c->{full}++ if !%lost;
    $c->{only}++ if $only;
    $c->{both}++ if $only && $all;
    $c->{named}++ if $named;
    $c->{known}++ if @want == @{ $row->{names} } && @want;
    $c->{wrong}++ if $wrong;
    $c->{provisional}++ if $g->{provisional};
    $c->{held}++ if $row->{held};
    $c->{held_only}++ if $row->{held} && $only;
    $c->{cpu} += $g->{cpu_s} // 0;
    my $as_it_is = $row->{kind} eq 'right' ? (%lost ? '**no**' : 'yes') : !%lost ? '**none lost**' : $only ? ($all || $row->{kind} eq 'bug' ? 'yes' : 'yes, not of both') : '**no**';
    my ($commit) = ($g->{version} // '') =~ /commit (\w{8})/;
    push @lines, sprintf "| %s%s | %s | %s | %s | %s | %s | %s | %s | %.0f | %s |\n", $row->{id}, $row->{held} ? ' (held)' : '', $row->{what}, join(', ', @{ $row->{parts} }),
        join(', ', map { sprintf '%s: %.3g of %g', $_, $lost{$_}, $parts{$_} } sort keys %lost) || 'none', $as_it_is,
        ($wrong ? '**wrong:** ' : '') . join('; ', map { join ' or ', map { join ' and ', @$_ } @$_ } @found) . ($named ? ' (right)' : ''),
        $g->{located} // '', $g->{provisional} ? 'yes' : '', $g->{cpu_s} // 0, $commit // '';
}
print "| program | what it is | part | points lost | as it is | named | located | provisional | CPU s | graded by |\n|---|---|---|---|---|---|---|---|--:|---|\n", @lines, "\n";
for my $kind (qw(right bug pair drawn)) {
    my $c = $of{$kind} or next;
    my $n = sub { $c->{ $_[0] } // 0 };
    my $end = sprintf "wrong names: %d; provisional: %d; %.0f CPU s each.\n", $n->('wrong'), $n->('provisional'), $n->('cpu') / $n->('n');
    printf "- Right programs: %d of %d keep all points; %s", $n->('full'), $n->('n'), $end if $kind eq 'right';
    printf "- Bugs: %d of %d lose points in their own part alone (held aside: %d of %d), %d lose none; of %d in the catalogue %d are named; %s", $n->('only'), $n->('n'),
        $n->('held_only'), $n->('held'), $n->('full'), $n->('known'), $n->('named'), $end if $kind eq 'bug';
    printf "- %s: %d of %d lose points in the two parts alone, %d of them in both; of %d in the catalogue both are named in %d; %s",
        $kind eq 'pair' ? 'Pairs' : 'Pairs drawn', $n->('only'), $n->('n'), $n->('both'), $n->('known'), $n->('named'), $end if $kind eq 'pair' || $kind eq 'drawn';
}
exit((($of{right} // {})->{n} // 0) > (($of{right} // {})->{full} // 0) || grep { $_->{wrong} } values %of);
