(** Linear temporal logic on words without end, and what is put off.

    [holds f w i]: the word, from its place i on, satisfies f. *)

Require Import List Bool Arith Lia ClassicalDedekindReals.
From LtlPlan Require Import Progression.
Import ListNotations.

Definition endless : Type := nat -> letter.

Fixpoint holds (f : formula) (w : endless) (i : nat) : Prop :=
  match f with
  | Lit b p => shows (w i) p = b
  | Const b => b = true
  | And g h => holds g w i /\ holds h w i
  | Or g h => holds g w i \/ holds h w i
  | Until g h => exists j, i <= j /\ holds h w j /\ forall k, i <= k < j -> holds g w k
  | Release g h => forall j, i <= j -> holds h w j \/ exists k, i <= k < j /\ holds g w k
  end.

Fixpoint sholds (f : spec) (w : endless) (i : nat) : Prop :=
  match f with
  | SAtom p => shows (w i) p = true
  | STrue => True
  | SNot g => ~ sholds g w i
  | SAnd g h => sholds g w i /\ sholds h w i
  | SOr g h => sholds g w i \/ sholds h w i
  | SUntil g h => exists j, i <= j /\ sholds h w j /\ forall k, i <= k < j -> sholds g w k
  | SRelease g h => forall j, i <= j -> sholds h w j \/ exists k, i <= k < j /\ sholds g w k
  end.

(** ** A formula holds or does not: an axiom of the reals says so of all places of a word *)

Definition told (P : nat -> Prop) : Type := forall n, {P n} + {~ P n}.

Lemma told_until : forall P Q, told P -> told Q -> forall i,
  {exists j, i <= j /\ Q j /\ forall k, i <= k < j -> P k} +
  {~ exists j, i <= j /\ Q j /\ forall k, i <= k < j -> P k}.
Proof.
  intros P Q DP DQ i.
  assert (B : forall j, {forall k, i <= k < j -> P k} + {~ forall k, i <= k < j -> P k}).
  { induction j as [|j [IH|IH]]; [left; lia | | right; intros H; apply IH; intros; apply H; lia].
    destruct (le_lt_dec i j) as [L|L]; [|left; lia].
    destruct (DP j) as [H|H]; [left | right; intros K; apply H, K; lia].
    intros k K; destruct (Nat.eq_dec k j) as [->|]; auto; apply IH; lia. }
  destruct (sig_forall_dec (fun j => ~ (i <= j /\ Q j /\ forall k, i <= k < j -> P k))) as [[j H]|H].
  - intros j; destruct (le_lt_dec i j), (DQ j), (B j); (left; tauto) || (left; lia) || (right; tauto).
  - left; exists j; destruct (le_lt_dec i j), (DQ j), (B j); tauto || lia || (exfalso; apply H; lia || tauto).
  - right; intros [j K]; apply (H j K).
Defined.

Lemma told_not : forall P, told P -> told (fun n => ~ P n).
Proof. intros P D n; destruct (D n); [right | left]; tauto. Defined.

Lemma found_below : forall P, told P -> forall i j, ~ (forall k, i <= k < j -> ~ P k) ->
  exists k, i <= k < j /\ P k.
Proof.
  intros P D i; induction j as [|j IH]; intros H; [exfalso; apply H; lia|].
  destruct (le_lt_dec i j) as [L|L]; [|exfalso; apply H; lia].
  destruct (D j) as [Y|N]; [exists j; split; auto; lia|].
  destruct IH as (k & K & Y); [|exists k; split; auto; lia].
  intros A; apply H; intros k K; destruct (Nat.eq_dec k j) as [->|]; auto; apply A; lia.
Qed.

Lemma release_is : forall P Q, told P -> told Q -> forall i,
  ~ (exists j, i <= j /\ ~ Q j /\ forall k, i <= k < j -> ~ P k) <->
  (forall j, i <= j -> Q j \/ exists k, i <= k < j /\ P k).
Proof.
  intros P Q DP DQ i; split.
  - intros H j L; destruct (DQ j) as [Y|N]; auto; right; apply found_below; auto.
    intros A; apply H; exists j; auto.
  - intros H (j & L & N & A); destruct (H j L) as [Y | (k & K & Y)]; auto; apply (A k K Y).
Qed.

Lemma told_release : forall P Q, told P -> told Q -> forall i,
  {forall j, i <= j -> Q j \/ exists k, i <= k < j /\ P k} +
  {~ forall j, i <= j -> Q j \/ exists k, i <= k < j /\ P k}.
Proof.
  intros P Q DP DQ i.
  destruct (told_until _ _ (told_not P DP) (told_not Q DQ) i) as [H|H].
  - right; intros K; apply release_is in K; auto.
  - left; apply release_is; auto.
Defined.

Lemma holds_told : forall f w, told (holds f w).
Proof.
  induction f; intros w i; cbn [holds]; auto using told_until, told_release, bool_dec;
    destruct (IHf1 w i), (IHf2 w i); tauto.
Defined.

Lemma sholds_told : forall f w, told (sholds f w).
Proof.
  induction f; intros w i; cbn [sholds]; auto using told_until, told_release, bool_dec;
    try (destruct (IHf1 w i), (IHf2 w i); tauto).
  destruct (IHf w i); tauto.
Defined.

(** ** Negation at propositions only *)

Lemma until_same : forall (P Q P' Q' : nat -> Prop) i,
  (forall n, P n <-> P' n) -> (forall n, Q n <-> Q' n) ->
  (exists j, i <= j /\ Q j /\ forall k, i <= k < j -> P k) <->
  (exists j, i <= j /\ Q' j /\ forall k, i <= k < j -> P' k).
Proof.
  intros P Q P' Q' i HP HQ; split; intros (j & L & H & A); exists j; repeat split; auto;
    try (apply HQ; auto); intros k K; apply HP; auto.
Qed.

Lemma release_same : forall (P Q P' Q' : nat -> Prop) i,
  (forall n, P n <-> P' n) -> (forall n, Q n <-> Q' n) ->
  (forall j, i <= j -> Q j \/ exists k, i <= k < j /\ P k) <->
  (forall j, i <= j -> Q' j \/ exists k, i <= k < j /\ P' k).
Proof.
  intros P Q P' Q' i HP HQ; split; intros H j L; (destruct (H j L) as [Y | (k & K & Y)];
    [left; apply HQ; auto | right; exists k; split; auto; apply HP; auto]).
Qed.

Lemma normal_holds : forall f b w i,
  holds (normal b f) w i <-> (if b then sholds f w i else ~ sholds f w i).
Proof.
  induction f; intros b w i; cbn [normal].
  - cbn; destruct b, (shows (w i) p); split; congruence.
  - destruct b; cbn; tauto || (split; [discriminate | tauto]).
  - rewrite IHf; cbn [sholds]; destruct b; cbn [negb]; auto; [tauto|].
    destruct (sholds_told f w i); tauto.
  - destruct b; cbn [holds sholds]; rewrite IHf1, IHf2; try tauto.
    destruct (sholds_told f1 w i), (sholds_told f2 w i); tauto.
  - destruct b; cbn [holds sholds]; rewrite IHf1, IHf2; tauto.
  - destruct b; cbn [holds sholds].
    + apply until_same; intros n; [apply (IHf1 true) | apply (IHf2 true)].
    + rewrite (release_same _ _ (fun n => ~ sholds f1 w n) (fun n => ~ sholds f2 w n));
        [|intros n; apply (IHf1 false) | intros n; apply (IHf2 false)].
      rewrite <- release_is; auto using told_not, sholds_told.
      apply not_iff_compat, until_same; intros n;
        [destruct (sholds_told f1 w n) | destruct (sholds_told f2 w n)]; tauto.
  - destruct b; cbn [holds sholds].
    + apply release_same; intros n; [apply (IHf1 true) | apply (IHf2 true)].
    + rewrite (until_same _ _ (fun n => ~ sholds f1 w n) (fun n => ~ sholds f2 w n));
        [|intros n; apply (IHf1 false) | intros n; apply (IHf2 false)].
      pose proof (release_is _ _ (sholds_told f1 w) (sholds_told f2 w) i) as R; rewrite <- R.
      destruct (told_until _ _ (told_not _ (sholds_told f1 w)) (told_not _ (sholds_told f2 w)) i); tauto.
Qed.

Theorem endless_refuted : forall f w i, ~ holds (normal false f) w i -> sholds f w i.
Proof.
  intros f w i N; destruct (sholds_told f w i); auto; exfalso; apply N, normal_holds; auto.
Qed.

(** ** A letter that is held may be read any number of times *)

(** [h] says which letter of [v] is read at each place: letter after letter, none left out. *)
Definition held (h : nat -> nat) : Prop :=
  (forall i, h (S i) = h i \/ h (S i) = S (h i)) /\ forall n, exists i, n <= h i.

Lemma held_grows : forall h, held h -> forall i j, i <= j -> h i <= h j.
Proof. intros h [S1 _] i j L; induction L as [|j L IH]; auto; destruct (S1 j); lia. Qed.

Lemma held_reaches : forall h, held h -> forall i n, h i <= n ->
  exists j, i <= j /\ h j = n /\ forall k, i <= k < j -> h k < n.
Proof.
  intros h H i n L; destruct H as [H1 H2]; destruct (H2 n) as [m M].
  assert (G : forall d j, d = m - j -> i <= j -> (forall k, i <= k < j -> h k < n) -> j <= m -> h j <= n ->
    exists j, i <= j /\ h j = n /\ forall k, i <= k < j -> h k < n).
  { induction d as [|d IH]; intros j D Lj B Jm Hj.
    - exists j; repeat split; auto; assert (j = m) by lia; subst; lia.
    - destruct (Nat.eq_dec (h j) n) as [E|NE]; [exists j; auto|].
      apply (IH (S j)); try lia.
      + intros k K; destruct (Nat.eq_dec k j) as [->|]; [lia | apply B; lia].
      + destruct (H1 j); lia. }
  destruct (le_lt_dec i m) as [Lm|Lm].
  - apply (G (m - i) i); auto; lia.
  - exists i; repeat split; auto; try lia.
    pose proof (held_grows h (conj H1 H2) m i); lia.
Qed.

Theorem held_letters : forall h v, held h -> forall f i, sholds f (fun n => v (h n)) i <-> sholds f v (h i).
Proof.
  intros h v H; pose proof (held_grows h H) as G.
  induction f; intros i; cbn [sholds]; rewrite ?IHf, ?IHf1, ?IHf2; try tauto; split.
  - intros (j & L & Y & A); exists (h j); split; [auto|]; split; [apply IHf2; auto|].
    intros n N; destruct (held_reaches h H i n) as (k & K & <- & B); [lia|].
    apply IHf1, A; split; auto; destruct (le_lt_dec j k) as [Ljk|]; auto.
    specialize (G j k Ljk); lia.
  - intros (n & L & Y & A); destruct (held_reaches h H i n L) as (j & Lj & <- & B).
    exists j; split; auto; split; [apply IHf2; auto|].
    intros k K; apply IHf1, A; split; [apply G; lia | apply B; lia].
  - intros Rl n L; destruct (held_reaches h H i n L) as (j & Lj & <- & B).
    destruct (Rl j Lj) as [Y | (k & K & Y)]; [left; apply IHf2; auto | right].
    exists (h k); split; [split; [apply G; lia | apply B; lia] | apply IHf1; auto].
  - intros Rl j L; destruct (Rl (h j) (G i j L)) as [Y | (n & N & Y)]; [left; apply IHf2; auto | right].
    destruct (held_reaches h H i n) as (k & K & <- & B); [lia|].
    exists k; split; [split; auto | apply IHf1; auto].
    destruct (le_lt_dec j k) as [Ljk|]; auto; specialize (G j k Ljk); lia.
Qed.

(** ** Progression that says what it puts off

    A choice: what the rest of the word owes, and which untils are put off, being
    satisfied while what they wait for is not there. *)

Definition choice : Type := alternative * alternative.

Definition easier (c d : choice) : bool :=
  includes (fst c) (fst d) && includes (snd c) (snd d).

Fixpoint easiest (s : list choice) : list choice :=
  match s with
  | [] => []
  | c :: r =>
      let t := easiest r in
      if existsb (easier c) t then t else c :: filter (fun d => negb (easier d c)) t
  end.

Definition some_of (s t : list choice) : list choice := easiest (s ++ t).
Definition all_of (s t : list choice) : list choice :=
  easiest (flat_map (fun c => map (fun d => (merge (fst c) (fst d), merge (snd c) (snd d))) t) s).

Definition choice_now (b : bool) : list choice := if b then [([], [])] else [].

Fixpoint unwind (a : letter) (f : formula) : list choice :=
  match f with
  | Lit b p => choice_now (Bool.eqb (shows a p) b)
  | Const b => choice_now b
  | And g h => all_of (unwind a g) (unwind a h)
  | Or g h => some_of (unwind a g) (unwind a h)
  | Until g h => some_of (unwind a h) (all_of (unwind a g) [([f], [f])])
  | Release g h => all_of (unwind a h) (some_of (unwind a g) [([f], [])])
  end.

Definition unwind_all (a : letter) (c : alternative) : list choice :=
  fold_right (fun f s => all_of (unwind a f) s) [([], [])] c.

(** An until is put off at a place. *)
Definition put_off (w : endless) (i : nat) (f : formula) : Prop :=
  match f with Until g h => holds f w i /\ ~ holds h w i | _ => False end.

Definition good (w : endless) (i : nat) (c : choice) : Prop :=
  (forall f, In f (fst c) -> holds f w (S i)) /\ (forall f, In f (snd c) -> put_off w i f).

Definition open (s : list choice) (w : endless) (i : nat) : Prop := exists c, In c s /\ good w i c.

Lemma includes_in : forall c d, includes c d = true -> forall f, In f d -> In f c.
Proof.
  intros c d I f H; unfold includes in I; rewrite forallb_forall in I.
  apply I, existsb_exists in H as (g & G & E); apply same_eq in E; subst; auto.
Qed.

Lemma easier_good : forall c d w i, easier c d = true -> good w i c -> good w i d.
Proof.
  intros c d w i E [G1 G2]; apply andb_prop in E as [E1 E2]; split; intros f H;
    [apply G1, (includes_in _ _ E1) | apply G2, (includes_in _ _ E2)]; auto.
Qed.

Lemma easiest_open : forall s w i, open s w i -> open (easiest s) w i.
Proof.
  induction s as [|d s IH]; intros w i (c & Hc & G); [destruct Hc|]; cbn.
  destruct (existsb (easier d) (easiest s)) eqn:E.
  - destruct Hc as [->|Hc]; [|apply IH; exists c; auto].
    apply existsb_exists in E as (e & He & L); exists e; eauto using easier_good.
  - destruct Hc as [->|Hc]; [exists c; split; [left|]; auto|].
    destruct (IH w i) as (e & He & Ge); [exists c; auto|].
    destruct (easier e d) eqn:L.
    + exists d; split; [left; auto | apply (easier_good e); auto].
    + exists e; split; auto; right; apply filter_In; rewrite L; auto.
Qed.

Lemma some_open : forall s t w i, open s w i \/ open t w i -> open (some_of s t) w i.
Proof.
  intros s t w i [(c & H & G) | (c & H & G)]; apply easiest_open; exists c; split; auto;
    apply in_or_app; auto.
Qed.

Lemma merge_in : forall c d f, In f (merge c d) -> In f c \/ In f d.
Proof.
  intros c d f H; apply in_app_or in H as [H|H]; auto; apply filter_In in H as [H _]; auto.
Qed.

Lemma all_open : forall s t w i, open s w i -> open t w i -> open (all_of s t) w i.
Proof.
  intros s t w i (c & Hc & C1 & C2) (d & Hd & D1 & D2); apply easiest_open.
  exists (merge (fst c) (fst d), merge (snd c) (snd d)); split.
  - apply in_flat_map; exists c; split; auto; apply in_map_iff; exists d; auto.
  - split; cbn; intros f H; apply merge_in in H as [H|H]; auto.
Qed.

Lemma choice_open : forall b w i, b = true -> open (choice_now b) w i.
Proof. intros b w i ->; exists ([], []); split; [left; auto | split; intros f []]. Qed.

Lemma until_next : forall g h w i, holds (Until g h) w i -> ~ holds h w i ->
  holds g w i /\ holds (Until g h) w (S i).
Proof.
  intros g h w i (j & L & Y & A) N; destruct (Nat.eq_dec i j) as [->|]; [contradiction|].
  split; [apply A; lia|]; exists j; repeat split; auto; [lia|]; intros k K; apply A; lia.
Qed.

Lemma release_next : forall g h w i, holds (Release g h) w i ->
  holds h w i /\ (holds g w i \/ holds (Release g h) w (S i)).
Proof.
  intros g h w i Rl; split.
  - destruct (Rl i (le_n i)) as [Y | (k & K & _)]; auto; lia.
  - destruct (holds_told g w i) as [Y|N]; [auto | right]; intros j L.
    destruct (Rl j) as [Y | (k & K & Y)]; [lia | auto | right].
    destruct (Nat.eq_dec k i) as [->|]; [contradiction | exists k; split; auto; lia].
Qed.

Theorem unwind_open : forall f w i, holds f w i -> open (unwind (w i) f) w i.
Proof.
  induction f; intros w i H; cbn [unwind].
  - apply choice_open; cbn in H; rewrite H; apply eqb_reflx.
  - apply choice_open, H.
  - destruct H; apply all_open; auto.
  - apply some_open; destruct H; auto.
  - apply some_open; destruct (holds_told f2 w i) as [Y|N]; [left; auto | right].
    destruct (until_next f1 f2 w i H N) as [G U]; apply all_open; auto.
    exists ([Until f1 f2], [Until f1 f2]); split; [left; auto|].
    split; intros f [<-|[]]; [exact U | split; auto].
  - apply release_next in H as [Hh Hg]; apply all_open; auto; apply some_open.
    destruct Hg as [Hg|Hg]; [left; auto | right].
    exists ([Release f1 f2], []); split; [left; auto|]; split; intros f F; [|destruct F].
    destruct F as [<-|[]]; auto.
Qed.

Lemma unwind_all_open : forall c w i, (forall f, In f c -> holds f w i) -> open (unwind_all (w i) c) w i.
Proof.
  induction c as [|f c IH]; intros w i H; cbn.
  - exists ([], []); split; [left; auto | split; intros f []].
  - apply all_open; [apply unwind_open, H; left; auto | apply IH; intros; apply H; right; auto].
Qed.
